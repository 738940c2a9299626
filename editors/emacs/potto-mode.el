;;; potto-mode.el --- Potto in Emacs, with Eglot  -*- lexical-binding: t; -*-

;; Version: 0.1.0
;; Package-Requires: ((emacs "26.3") (eglot "1.9"))
;; Keywords: languages
;; SPDX-License-Identifier: MIT

;;; Commentary:

;; Colours, indentation and comments for Potto, and its language server:
;;
;;   (require 'potto-mode)
;;   (add-hook 'potto-mode-hook #'eglot-ensure)

;;; Code:

(require 'prog-mode)
(require 'comint)

(defgroup potto nil
  "A differentiable language with an integral primitive."
  :group 'languages)

(defcustom potto-program "potto"
  "The program that is Potto."
  :type 'string)

(defvar potto-mode-syntax-table
  (let ((table (make-syntax-table)))
    (modify-syntax-entry ?# "<" table)
    (modify-syntax-entry ?\n ">" table)
    (modify-syntax-entry ?_ "w" table)
    (modify-syntax-entry ?\\ "." table)
    (modify-syntax-entry ?\" "." table)
    (dolist (operator '(?+ ?- ?* ?/ ?^ ?< ?> ?= ?~ ?? ?. ?: ?,))
      (modify-syntax-entry operator "." table))
    table)
  "Syntax of Potto.")

(defconst potto--keywords
  '("and" "as" "def" "diffeo" "else" "for" "from" "if" "import" "in" "integral" "let" "not" "or" "sum" "then"))

(defconst potto--builtins
  '("abs" "acos" "asin" "atan" "atan2" "besselj0" "besselj1" "ceil" "clamp" "cos" "cosh" "cross" "digamma" "dot" "erf"
    "erfc" "erfinv" "exp" "expm1" "floor" "gamma" "hypot" "image" "interp" "len" "lgamma" "load" "log" "log1p" "max"
    "min" "norm" "pow" "sech" "sign" "sin" "sinc" "sinh" "sqrt" "tan" "tanh" "trigamma" "fst" "snd" "print" "deriv"
    "delta" "grad" "D"))

(defconst potto-font-lock-keywords
  `(("^\\s-*#>" 0 font-lock-doc-face t)
    ("\\_<\\(?:def\\|diffeo\\)\\_>\\s-+\\(\\w+\\)" 1 font-lock-function-name-face)
    ("^\\(\\w+\\)\\s-*=\\s-*\\(?:\\\\\\|λ\\|deriv\\_>\\)" 1 font-lock-function-name-face)
    ("^\\s-+\\(inverse\\|where\\)\\_>" 1 font-lock-keyword-face)
    (,(regexp-opt potto--keywords 'symbols) . font-lock-keyword-face)
    ("\\_<\\(product\\|min\\|max\\)\\s-+\\w+\\s-+in\\_>" 1 font-lock-keyword-face)
    ("\\_<\\(fold\\)\\(?:\\s-+\\w+\\|\\s-*([^()]*)\\)\\s-*=[^=]" 1 font-lock-keyword-face)
    ("\\_<\\(with\\)\\s-+(?\\w+\\s-*=[^=]" 1 font-lock-keyword-face)
    ("^\\(record\\)\\s-+\\(\\w+\\)\\s-*(" (1 font-lock-keyword-face) (2 font-lock-type-face))
    ("\"[^\"\n]*\"" 0 font-lock-string-face)
    ("∫\\|\\\\\\|λ" . font-lock-keyword-face)
    ("\\_<\\(d\\)(" 1 font-lock-keyword-face)
    (,(regexp-opt '("pi" "inf") 'symbols) . font-lock-constant-face)
    (,(regexp-opt potto--builtins 'symbols) . font-lock-builtin-face)
    ("~\\s-*\\(\\w+\\)" 1 font-lock-type-face)
    (,(regexp-opt '("Real" "Dist" "Diffeo") 'symbols) . font-lock-type-face))
  "What is coloured in Potto.")

(defun potto-indent-line ()
  "Indent a line like the one above, or a step more where a block begins.
Again: a step less."
  (interactive)
  (let* ((above (save-excursion
                  (forward-line -1)
                  (while (and (not (bobp)) (looking-at-p "[ \t]*$")) (forward-line -1))
                  (current-indentation)))
         (opens (save-excursion
                  (forward-line -1)
                  (looking-at-p "[ \t]*\\(?:def\\_>.*)[ \t]*:?\\|for\\_>.*:\\|.*[[(]\\)[ \t]*$")))
         (wanted (if opens (+ above 4) above))
         (now (current-indentation)))
    (when (and (eq last-command this-command) (> now 0))
      (setq wanted (max 0 (- now 4))))
    (if (<= (current-column) now)
        (indent-line-to wanted)
      (save-excursion (indent-line-to wanted)))))

;;;###autoload
(define-derived-mode potto-mode prog-mode "Potto"
  "A mode for Potto programs."
  (setq-local comment-start "# "
              comment-end ""
              comment-start-skip "#+[>=]?\\s-*"
              indent-tabs-mode nil
              indent-line-function #'potto-indent-line
              font-lock-defaults '(potto-font-lock-keywords)))

;;;###autoload
(add-to-list 'auto-mode-alist '("\\.\\(?:po\\|diffeo\\)\\'" . potto-mode))

(defvar eglot-server-programs)
(with-eval-after-load 'eglot
  (add-to-list 'eglot-server-programs (cons 'potto-mode (lambda (&rest _) (list potto-program "lsp")))))

(declare-function eglot-current-server "eglot")
(declare-function eglot--TextDocumentIdentifier "eglot")
(declare-function jsonrpc-request "jsonrpc")

(defun potto--command (command &rest arguments)
  "The text that the server answers to COMMAND.
It is given the buffer's URI and ARGUMENTS."
  (let ((uri (plist-get (eglot--TextDocumentIdentifier) :uri)))
    (plist-get (jsonrpc-request (or (eglot-current-server) (user-error "No language server; try M-x eglot"))
                                :workspace/executeCommand
                                (list :command command :arguments (vconcat (list uri) arguments)))
               :text)))

(defun potto-evaluate (expression)
  "Show the value of EXPRESSION in the names of this file."
  (interactive "sEvaluate: ")
  (message "%s" (potto--command "potto.evaluate" expression)))

(defun potto-derivative (name)
  "Show the derivative of the definition NAME in symbols."
  (interactive (list (or (thing-at-point 'symbol t) (read-string "Derivative of: "))))
  (let ((text (potto--command "potto.differentiate" name)))
    (with-current-buffer (get-buffer-create (format "*derivative of %s*" name))
      (let ((inhibit-read-only t))
        (erase-buffer)
        (insert text)
        (potto-mode)
        (view-mode))
      (display-buffer (current-buffer)))))

(defun potto-more (name)
  "Choose from what can be done with the definition NAME.
The server asks, and shows what comes of it."
  (interactive (list (or (thing-at-point 'symbol t) (read-string "Definition: "))))
  (potto--command "potto.more" name))

(defun potto-view ()
  "Show the integrals of this file as a page in the browser, until Emacs ends."
  (interactive)
  (set-process-query-on-exit-flag (start-process "potto-view" nil potto-program "view" buffer-file-name) nil))

(defun potto-run ()
  "Run this file."
  (interactive)
  (compile (mapconcat #'shell-quote-argument (list potto-program "run" buffer-file-name) " ")))

(defun potto-repl ()
  "A prompt with the names of this file."
  (interactive)
  (pop-to-buffer (make-comint "potto" potto-program nil "repl" buffer-file-name)))

(provide 'potto-mode)
;;; potto-mode.el ends here
