-- Run by test_neovim.py: which functions of `vim.lsp` are called, where it has today's and where it has those of 0.7.
package.path = vim.env.POTTO_EDITORS .. "/neovim/?.lua;" .. package.path
local found = {}
local function noted(name, answer)
  return function() table.insert(found, name) return answer end
end
vim.lsp.buf_attach_client = noted("buf_attach_client", true)
vim.lsp.get_client_by_id = function() return {} end
vim.lsp.start_client = noted("start_client", 1)
vim.lsp.inlay_hint = nil
vim.lsp.codelens = { refresh = noted("codelens.refresh") }
if vim.env.POTTO_TODAY == "1" then
  vim.lsp.start = noted("start", 1)
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
