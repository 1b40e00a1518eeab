# Warnings are errors everywhere; sanitizers are chosen by the preset.
add_library(hil_compile_options INTERFACE)
target_compile_features(hil_compile_options INTERFACE cxx_std_20)
target_compile_options(hil_compile_options INTERFACE
  -Wall -Wextra -Wpedantic -Werror -Wshadow -Wconversion -Wno-sign-conversion -Wnon-virtual-dtor
  -Woverloaded-virtual -Wimplicit-fallthrough -Wdouble-promotion
  # One arithmetic on every machine: no fused multiply-add behind the source's back.
  -ffp-contract=off)
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  # GCC 12 treats the conversion of a pair of doubles to float and back as the identity, so remainders of
  # single precision become zero.
  target_compile_options(hil_compile_options INTERFACE -fno-tree-slp-vectorize)
endif()

option(HIL_COMPILE_TOGETHER "compile what most sources include once, and several sources as one" OFF)
set(HIL_SANITIZE "" CACHE STRING "sanitizers, comma separated: address,undefined or thread")
if(HIL_SANITIZE)
  add_compile_options(-fsanitize=${HIL_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${HIL_SANITIZE})
endif()
