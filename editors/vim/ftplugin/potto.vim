if exists("b:did_ftplugin")
  finish
endif
let b:did_ftplugin = 1
setlocal commentstring=#\ %s comments=b:#>,b:#=,b:# expandtab shiftwidth=4 softtabstop=4 autoindent
setlocal makeprg=potto\ check\ --color\ never\ % errorformat=%f:%l:%c:\ %t%*[a-z][%m,%-G%.%#
let b:undo_ftplugin = "setlocal commentstring< comments< expandtab< shiftwidth< softtabstop< autoindent< makeprg< errorformat<"
