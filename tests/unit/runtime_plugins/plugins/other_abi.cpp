// A plug-in that says that it was compiled for an older hil.

#include <hil/plugin.hpp>

#undef HIL_ABI
#define HIL_ABI "hil 0.0, C++ ABI 1017, strings 1, debug mode off"

HIL_PLUGIN("other_abi", "1")
