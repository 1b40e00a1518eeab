# Writes the SPIR-V module BINARY into the header WORDS, which defines `const uint32_t NAME_words[]`.
file(READ ${BINARY} bytes HEX)
string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1," words "${bytes}")
set(word "0x[0-9a-f]+,")
set(more "(${word})?")
string(REGEX REPLACE "(${word}${more}${more}${more}${more}${more}${more}${more})" "\\1\n" words "${words}")
file(WRITE ${WORDS} "const uint32_t ${NAME}_words[] = {\n${words}};\n")
