#include <hil/numbers.hpp>
#include <hil/world/relation.hpp>

namespace hil::expression {

std::string relation_name(const Relation& relation) {
  std::string name =
      std::string(relation.function->name) + "(" + relation.first.text + ", " + relation.second.text;
  if (relation.window_s != max_impact_window_s)
    name += ", " + config::format_number(relation.window_s) + " s";
  return name + ")";
}

}  // namespace hil::expression
