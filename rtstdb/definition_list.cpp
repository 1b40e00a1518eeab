#include "rtstdb/definition_list.hpp"

#include <string>

#include "rtstdb/log/format.hpp"
#include "rtstdb/log_space.hpp"

namespace rtstdb {

template <class Value>
DefinitionList<Value>::DefinitionList(std::span<const log::LoggedDefinition<Value>> recovered) {
  for (const log::LoggedDefinition<Value>& definition : recovered) {
    table_.prepare(definition.value, definition.name);
    table_.publish();
  }
}

template <class Value>
auto DefinitionList<Value>::add(const Value& value, std::string_view name, transaction::Engine& engine)
    -> Result<Id> {
  if (engine.log() != nullptr && name.size() > log::max_name_bytes)
    return Error{ErrorCode::bad_input, "the name has " + std::to_string(name.size()) +
                                           " bytes; the log allows at most " +
                                           std::to_string(log::max_name_bytes)};
  const std::lock_guard lock(mutex_);
  if (table_.is_full()) return Error{ErrorCode::capacity, store::DefinitionKind<Value>::too_many};
  const Id id = table_.prepare(value, name);
  std::optional<log::LoggedDefinition<Value>> logged;
  if (engine.log() != nullptr) logged = {id, std::string(name), value};
  bool added = false;
  const auto add_on_engine = [&] {
    if (logged && !engine.log()->has_space_for(*logged)) return;
    if (logged) engine.log()->record_definition(*logged);
    table_.publish();
    added = true;
  };
  if (auto called = call_until(engine, add_on_engine, [&] { return added; }); !called) return called.error();
  return id;
}

template <class Value>
auto DefinitionList<Value>::find(std::string_view name) const -> std::optional<Id> {
  const std::lock_guard lock(mutex_);
  return table_.find(name);
}

template class DefinitionList<Material>;
template class DefinitionList<Light>;

}  // namespace rtstdb
