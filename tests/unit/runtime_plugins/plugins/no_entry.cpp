// A note of a plug-in without the function that hil calls.

#include <hil/plugin.hpp>

HIL_PLUGIN_NOTE("no_entry", "1");
