-- Run by test_neovim.py: a real session in Neovim, whose findings are printed as JSON.
package.path = vim.env.POTTO_EDITORS .. "/neovim/?.lua;" .. package.path
vim.opt.runtimepath:prepend(vim.env.POTTO_EDITORS .. "/vim")
vim.cmd("filetype off | filetype plugin on | syntax on")
local found = {}
local attached = false
require("potto").setup({ on_attach = function() attached = true end })
vim.cmd("edit main.po")
local function wait(what, holds)
  assert(vim.wait(30000, holds, 20), what)
end
wait("the server did not start", function() return attached end)
wait("no diagnostics", function() return #vim.diagnostic.get(0) > 0 end)
found.filetype = vim.bo.filetype
found.commentstring = vim.bo.commentstring
for _, diagnostic in ipairs(vim.diagnostic.get(0)) do
  if diagnostic.severity == vim.diagnostic.severity.ERROR then
    found.diagnostic = { code = diagnostic.code, line = diagnostic.lnum, from = diagnostic.col, to = diagnostic.end_col, message = diagnostic.message }
  end
end
local function lenses()
  return vim.lsp.codelens.get(vim.api.nvim_get_current_buf()) or {}
end
wait("no lenses", function() return #lenses() > 0 end)
found.lenses = vim.tbl_map(function(lens) return lens.command and lens.command.title or "" end, lenses())
local function ask(method, params)
  local answers = assert(vim.lsp.buf_request_sync(0, method, params, 30000))
  for _, answer in pairs(answers) do
    assert(not answer.error, vim.inspect(answer.error))
    return answer.result
  end
end
vim.api.nvim_win_set_cursor(0, { 4, 4 })
local here = vim.lsp.util.make_position_params()
found.hover = ask("textDocument/hover", here).contents.value
vim.api.nvim_win_set_cursor(0, { 1, 20 })
vim.lsp.buf.rename("ball")
wait("nothing was renamed", function() return vim.fn.getline(1) == "from shapes import ball" end)
vim.cmd("silent! wall")
found.renamed = { vim.fn.getline(1), vim.fn.getline(4), vim.fn.readfile("shapes.po")[1] }
local actions = ask("textDocument/codeAction", {
  textDocument = here.textDocument,
  range = { start = { line = 2, character = 25 }, ["end"] = { line = 2, character = 25 } },
  context = { diagnostics = {} },
})
local action = actions[1]
if not action.edit then action = ask("codeAction/resolve", action) end
vim.lsp.util.apply_workspace_edit(action.edit, "utf-16")
found.fixed = vim.fn.getline(3)
wait("the diagnostic stays", function()
  return #vim.diagnostic.get(0, { severity = vim.diagnostic.severity.ERROR }) == 0
end)
vim.cmd("PottoEvaluate cover(0.5)")
wait("no answer", function() return #vim.api.nvim_list_wins() > 1 end)
found.value = vim.api.nvim_buf_get_lines(vim.api.nvim_win_get_buf(vim.api.nvim_list_wins()[2]), 0, -1, false)[1]
local function group(line, column)
  return vim.fn.synIDattr(vim.fn.synID(line, column, 1), "name")
end
found.groups = { group(2, 1), group(2, 5), group(3, 6), group(3, 22), group(3, vim.fn.col({ 3, "$" }) - 4) }
io.stdout:write("FOUND" .. vim.fn.json_encode(found) .. "\n")
vim.cmd("qall!")
