#include "runtime/modules/module.hpp"

#include <algorithm>

namespace hil::modules {

const rtstdb::Outcome& StepContext::execute(rtstdb::Database& database,
                                            rtstdb::Transaction& transaction) noexcept {
  const rtstdb::Outcome& outcome = database.execute(transaction);
  blocked_ns += (outcome.published - outcome.submitted).count();
  gpu_ns += outcome.gpu_time.count();
  if (!outcome.done() && failure == rtstdb::Status::idle) failure = outcome.status;
  return outcome;
}

const ModuleType* find_module_type(const std::string& name) {
  const auto& types = module_types();
  const auto found =
      std::find_if(types.begin(), types.end(), [&](const ModuleType& type) { return type.name == name; });
  return found == types.end() ? nullptr : &*found;
}

}  // namespace hil::modules
