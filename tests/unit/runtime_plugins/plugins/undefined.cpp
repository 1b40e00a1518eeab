// A plug-in that needs a function which no library has.

#include <hil/plugin.hpp>

hil::modules::ModuleType missing_type();

HIL_PLUGIN("undefined", "1", missing_type())
