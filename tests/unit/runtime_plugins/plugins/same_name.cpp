// A plug-in whose module type has the name of one of hil.

#include <hil/plugin.hpp>

namespace {

hil::modules::ModuleType block_type() {
  using namespace hil;
  return {.name = "block",
          .about = "Another block.",
          .parameters = config::Schema::record({}),
          .create = [](const config::Value&, const modules::TaskParameters&,
                       config::Diagnostics&) -> std::unique_ptr<modules::AnyModule> { return nullptr; }};
}

}  // namespace

HIL_PLUGIN("same_name", "1", block_type())
