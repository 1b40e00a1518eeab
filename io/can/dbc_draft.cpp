#include "io/can/dbc_draft.hpp"

namespace hil::io::can {

DbcMessage* DbcDraft::message_of_id(std::uint32_t file_id) {
  const auto found = message_by_id.find(file_id);
  return found == message_by_id.end() ? nullptr : &database.messages[found->second];
}

DbcMessage* DbcDraft::find_message(std::uint32_t file_id, std::size_t position, DbcProblems& problems) {
  DbcMessage* const message = message_of_id(file_id);
  if (message == nullptr && file_id != pseudo_message_id)
    problems.report(DbcProblem::Severity::warning, position,
                    "no message has the identifier " + std::to_string(file_id));
  return message;
}

DbcSignal* DbcDraft::find_signal(std::uint32_t file_id, std::string_view name, std::size_t position,
                                 DbcProblems& problems) {
  DbcMessage* const message = find_message(file_id, position, problems);
  if (message == nullptr) return nullptr;
  const auto& signals = note_of(*message).signal_by_name;
  const auto found = signals.find(std::string(name));
  if (found == signals.end()) {
    problems.report(DbcProblem::Severity::warning, position,
                    "message '" + message->name + "' has no signal '" + std::string(name) + "'");
    return nullptr;
  }
  return &message->signals[found->second];
}

}  // namespace hil::io::can
