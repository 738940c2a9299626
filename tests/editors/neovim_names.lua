-- Run by test_neovim.py: which functions of `vim.lsp` are called, where it has today's and where it has those of 0.7.
package.path = vim.env.POTTO_EDITORS .. "/neovim/?.lua;" .. package.path
local found = {}
local function noted(name, answer)
  return function() table.insert(found, name) return answer end
end
local config
local function attaches(name)
  return function(buffer) table.insert(found, name) config.on_attach({}, buffer) return true end
end
vim.lsp.buf_attach_client = attaches("buf_attach_client")
vim.lsp.get_client_by_id = function() return {} end
vim.lsp.start_client = function(given) table.insert(found, "start_client") config = given return 1 end
vim.lsp.inlay_hint = nil
vim.lsp.codelens = { refresh = noted("codelens.refresh") }
if vim.env.POTTO_TODAY == "1" then
  vim.lsp.start = function(given, options) config = given return attaches("start")(options.bufnr) and 1 end
  vim.lsp.inlay_hint = { enable = noted("inlay_hint.enable") }
  vim.lsp.codelens.enable = noted("codelens.enable")
else
  vim.lsp.start = nil
end
require("potto").setup({})
vim.cmd("edit one.po | set filetype=potto")
vim.cmd("edit two.po | set filetype=potto")
vim.cmd("doautocmd InsertLeave")
io.stdout:write("FOUND" .. vim.fn.json_encode(found) .. "\n")
vim.cmd("qall!")
