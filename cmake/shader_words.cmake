# A SPIR-V module, BINARY, as a header, WORDS, that defines `const uint32_t NAME_words[]`.
file(READ ${BINARY} bytes HEX)
string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1," words "${bytes}")
string(REGEX REPLACE "((0x[0-9a-f]+,)(0x[0-9a-f]+,)?(0x[0-9a-f]+,)?(0x[0-9a-f]+,)?(0x[0-9a-f]+,)?(0x[0-9a-f]+,)?(0x[0-9a-f]+,)?(0x[0-9a-f]+,)?)" "\\1\n" words "${words}")
file(WRITE ${WORDS} "const uint32_t ${NAME}_words[] = {\n${words}};\n")
