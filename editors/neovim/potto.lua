-- Potto in Neovim 0.7 or newer: put this file into `lua/` of your configuration and call `require("potto").setup()`.
local M = {}

local defaults = {
  cmd = { "potto", "lsp" },
  settings = { potto = {} },
  on_attach = nil,
}

--- The nearest folder above a file that looks like the root of a project.
local function root_of(path)
  local start = vim.fn.fnamemodify(path, ":p:h")
  for _, mark in ipairs({ "potto.toml", ".git" }) do
    for _, found in ipairs({ vim.fn.findfile(mark, start .. ";"), vim.fn.finddir(mark, start .. ";") }) do
      if found ~= "" then
        return (vim.fn.fnamemodify(found, ":p"):gsub("/$", ""):gsub("/[^/]*$", ""))
      end
    end
  end
  return start
end

--- Values of live expressions as inlay hints (0.10 or newer), values of definitions as code lenses. Only once the server
--- has started: 0.7 asks for no lenses any more where it was asked to before.
local function show_values(buffer)
  if vim.lsp.inlay_hint and vim.lsp.inlay_hint.enable then
    vim.lsp.inlay_hint.enable(true, { bufnr = buffer })
  end
  if vim.lsp.codelens and vim.lsp.codelens.enable then -- 0.12, which keeps them itself
    vim.lsp.codelens.enable(true, { bufnr = buffer })
  elseif vim.lsp.codelens then
    local function refresh()
      vim.lsp.codelens.refresh({ bufnr = buffer })
    end
    vim.api.nvim_create_autocmd({ "BufEnter", "InsertLeave", "BufWritePost" }, {
      group = vim.api.nvim_create_augroup("potto_values_" .. buffer, { clear = true }),
      buffer = buffer,
      callback = refresh,
    })
    if buffer == vim.api.nvim_get_current_buf() then -- which 0.7 asks about whatever it is given
      refresh()
    end
  end
end

local clients = {} -- by root, in 0.7

--- Attach a buffer to the client of its root, which is started if there is none.
local function start(config, buffer)
  if vim.lsp.start then -- 0.8
    vim.lsp.start(config, { bufnr = buffer })
    return
  end
  local id = clients[config.root_dir]
  if not id or not vim.lsp.get_client_by_id(id) then
    id = vim.lsp.start_client(config)
    clients[config.root_dir] = id
  end
  if id then
    vim.lsp.buf_attach_client(buffer, id)
  end
end

local function attach(buffer, options)
  local name = vim.api.nvim_buf_get_name(buffer)
  if name == "" then
    return
  end
  local root = root_of(name)
  start({
    name = "potto",
    cmd = options.cmd,
    root_dir = root,
    workspace_folders = { { uri = vim.uri_from_fname(root), name = root } },
    settings = options.settings,
    init_options = options.settings,
    capabilities = vim.lsp.protocol.make_client_capabilities(),
    on_attach = function(client, attached)
      show_values(attached)
      if options.on_attach then
        options.on_attach(client, attached)
      end
    end,
  }, buffer)
end

--- Ask the server of a buffer to run one of its commands, and show the text that it answers.
local function command(name, ...)
  local arguments = { vim.uri_from_bufnr(0), ... }
  vim.lsp.buf_request(0, "workspace/executeCommand", { command = name, arguments = arguments }, function(failure, result)
    if failure then
      vim.notify(failure.message, vim.log.levels.ERROR)
    elseif result and result.text then
      vim.lsp.util.open_floating_preview(vim.split(result.text, "\n"), "potto", { border = "single" })
    end
  end)
end

--- Start the server for Potto files. `options`: `cmd`, `settings`, `on_attach`.
function M.setup(options)
  options = vim.tbl_deep_extend("force", defaults, options or {})
  local group = vim.api.nvim_create_augroup("potto", { clear = true })
  vim.api.nvim_create_autocmd("FileType", {
    group = group,
    pattern = "potto",
    callback = function(event)
      attach(event.buf, options)
    end,
  })
  vim.api.nvim_create_user_command("PottoEvaluate", function(given)
    command("potto.evaluate", given.args)
  end, { nargs = 1, desc = "The value of an expression in the names of this file" })
  vim.api.nvim_create_user_command("PottoDerivative", function(given)
    command("potto.differentiate", given.args ~= "" and given.args or vim.fn.expand("<cword>"))
  end, { nargs = "?", desc = "The derivative of a definition, in symbols" })
  vim.api.nvim_create_user_command("PottoView", function()
    vim.fn.jobstart({ options.cmd[1], "view", vim.api.nvim_buf_get_name(0) })
  end, { desc = "The integrals of this file, as a page in the browser, until Neovim ends" })
  vim.api.nvim_create_user_command("PottoMore", function(given)
    command("potto.more", given.args ~= "" and given.args or vim.fn.expand("<cword>"))
  end, { nargs = "?", desc = "What can be done with a definition, to choose from" })
  vim.api.nvim_create_user_command("PottoRun", "!potto run %", { desc = "Run this file" })
  vim.api.nvim_create_user_command("PottoRepl", "botright split | terminal potto repl %", { desc = "A prompt with the names of this file" })
  for _, buffer in ipairs(vim.api.nvim_list_bufs()) do
    if vim.api.nvim_buf_is_loaded(buffer) and vim.bo[buffer].filetype == "potto" then
      attach(buffer, options)
    end
  end
end

return M
