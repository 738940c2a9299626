" Vim syntax file for Potto.
if exists("b:current_syntax")
  finish
endif
let s:saved = &cpo
set cpo&vim

syntax match pottoName "\<\K\k*\>"
syntax match pottoOperator "[-+*/^<>=~?−≤≥≠]\|\.\.\|->"
syntax match pottoNumber "\<\d\+\(\.\(\.\)\@!\d*\)\?\([eE][-+]\?\d\+\)\?"

syntax keyword pottoConditional if then else
syntax keyword pottoRepeat for sum
syntax match pottoBuiltin "\<\(max\|min\)\>"
syntax match pottoRepeat "\<\(product\|min\|max\)\ze\s\+\K\k*\s\+in\>"
syntax match pottoRepeat "\<fold\ze\(\s\+\K\k*\|\s*([^()]*)\)\s*=[^=]"
syntax match pottoKeyword "\<with\ze\s\+(\?\K\k*\s*=[^=]"
syntax match pottoDefine "^record\ze\s\+\K\k*\s*("
syntax keyword pottoKeyword let in
syntax keyword pottoLogic and or not
syntax keyword pottoIntegral integral
syntax match pottoIntegral "∫"
syntax match pottoIntegral "\<d\ze("
syntax match pottoLambda "\\\|λ"
syntax keyword pottoInclude from import as
syntax keyword pottoDefine def nextgroup=pottoFunction skipwhite
syntax keyword pottoDefine diffeo nextgroup=pottoFunction skipwhite
syntax match pottoDefine "^\s\+\zs\(inverse\|where\)\>"
syntax match pottoFunction "\K\k*" contained
syntax match pottoFunction "^\K\k*\ze\s*=\s*\(\\\|λ\|deriv\>\)"
syntax keyword pottoConstant pi inf
syntax keyword pottoCalculus deriv delta grad D
syntax keyword pottoBuiltin abs acos asin atan atan2 besselj0 besselj1 ceil clamp cos cosh cross digamma dot erf erfc
syntax keyword pottoBuiltin erfinv exp expm1 floor gamma hypot image interp len lgamma load log log1p norm pow sech
syntax keyword pottoBuiltin sign sin sinc sinh sqrt tan tanh trigamma fst snd print
syntax match pottoMeasure "\(\~\s*\)\@<=\K\k*"
syntax keyword pottoType Real Dist Diffeo

syntax match pottoString "\"[^\"]*\""
syntax match pottoComment "#.*$" contains=pottoTodo,@Spell
syntax match pottoExpected "#=.*$"
syntax match pottoLive "#>" contained
syntax match pottoLiveLine "#>.*$" contains=pottoLive,pottoNumber,pottoOperator,pottoBuiltin,pottoCalculus,pottoConstant,pottoConditional,pottoIntegral,pottoLambda
syntax keyword pottoTodo contained TODO FIXME XXX

highlight default link pottoOperator Operator
highlight default link pottoNumber Number
highlight default link pottoConditional Conditional
highlight default link pottoRepeat Repeat
highlight default link pottoKeyword Keyword
highlight default link pottoLogic Operator
highlight default link pottoIntegral Statement
highlight default link pottoLambda Statement
highlight default link pottoInclude Include
highlight default link pottoDefine Define
highlight default link pottoFunction Function
highlight default link pottoConstant Constant
highlight default link pottoCalculus Special
highlight default link pottoBuiltin Function
highlight default link pottoMeasure Type
highlight default link pottoType Type
highlight default link pottoString String
highlight default link pottoComment Comment
highlight default link pottoExpected Comment
highlight default link pottoLive SpecialComment
highlight default link pottoTodo Todo

let b:current_syntax = "potto"
let &cpo = s:saved
unlet s:saved
