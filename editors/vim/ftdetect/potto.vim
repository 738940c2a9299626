" `.po` is also the ending of translations, which Vim knows; a Potto file has none of their words.
autocmd BufNewFile,BufRead *.diffeo setfiletype potto
autocmd BufNewFile,BufRead *.po if search('\v^(msgid|msgstr)>', 'nw') == 0 | set filetype=potto | endif
