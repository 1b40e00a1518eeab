#include "configs/crossing/aeb_controller/station.hpp"

#include <algorithm>

#include "io/can/assertion.hpp"

namespace hil::crossing::aeb {

namespace {

const can::Protection protected_message{"Counter", "Checksum"};

struct RequiredMessage {
  std::string message;
  std::vector<std::string> signals;
  can::Protection protection;
  can::Use use;
};

std::string object_name(std::size_t slot) {
  return "Object" + std::to_string(slot);
}

const std::vector<std::string> object_signal_names = {"Valid", "PosX",   "PosY", "VelX",
                                                      "VelY",  "Length", "Age"};

std::vector<RequiredMessage> required_messages() {
  std::vector<RequiredMessage> all = {
      {"EgoStatus", {"Speed", "YawRate"}, protected_message, can::Use::receive},
      {"ObjectHeader", {"ObjectCount", "ScanIndex"}, protected_message, can::Use::receive},
      {"BrakeCommand",
       {"Deceleration", "Warning", "Degraded", "AnswerTo"},
       protected_message,
       can::Use::send}};
  for (std::size_t slot = 0; slot < Station::object_slots; ++slot) {
    all.push_back({object_name(slot), object_signal_names, {}, can::Use::receive});
  }
  return all;
}

const can::DbcMessage& message_of(const can::Dbc& database, const std::string& name) {
  return *database.find_message(name);
}

std::size_t signal_index(const can::Dbc& database, const std::string& message_name,
                         const std::string& signal_name) {
  const can::DbcMessage& message = message_of(database, message_name);
  return static_cast<std::size_t>(message.find_signal(signal_name) - message.signals.data());
}

const can::Dbc& checked(const can::Dbc& database) {
  can::require(Station::database_problems(database).empty(),
               "the database has no problems (Station::database_problems)");
  return database;
}

}  // namespace

std::vector<std::string> Station::database_problems(const can::Dbc& database) {
  std::vector<std::string> problems;
  for (const RequiredMessage& need : required_messages()) {
    const can::DbcMessage* const message = database.find_message(need.message);
    if (message == nullptr) {
      problems.push_back("the database has no message '" + need.message + "'");
      continue;
    }
    for (const std::string& signal : need.signals) {
      if (message->find_signal(signal) == nullptr) {
        problems.push_back("message '" + need.message + "' has no signal '" + signal + "'");
      }
    }
    const auto more = can::coding_problems(*message, need.protection, need.use);
    problems.insert(problems.end(), more.begin(), more.end());
  }
  return problems;
}

Station::Station(const can::Dbc& database, const Parameters& parameters)
    : controller_(parameters),
      ego_status_(message_of(checked(database), "EgoStatus"), protected_message),
      object_header_(message_of(database, "ObjectHeader"), protected_message),
      brake_command_(message_of(database, "BrakeCommand"), protected_message),
      speed_(signal_index(database, "EgoStatus", "Speed")),
      yaw_rate_(signal_index(database, "EgoStatus", "YawRate")),
      object_signals_{},
      object_count_(signal_index(database, "ObjectHeader", "ObjectCount")),
      list_counter_(signal_index(database, "ObjectHeader", "Counter")),
      deceleration_(signal_index(database, "BrakeCommand", "Deceleration")),
      warning_(signal_index(database, "BrakeCommand", "Warning")),
      degraded_(signal_index(database, "BrakeCommand", "Degraded")),
      answer_to_(signal_index(database, "BrakeCommand", "AnswerTo")) {
  for (std::size_t slot = 0; slot < object_slots; ++slot) {
    objects_.emplace_back(message_of(database, object_name(slot)), can::Protection{});
  }
  for (std::size_t index = 0; index < object_signals_.size(); ++index) {
    object_signals_[index] = signal_index(database, "Object0", object_signal_names[index]);
  }
}

std::optional<can::Frame> Station::handle(const can::Frame& frame) {
  if (frame.is_error() || frame.direction == can::Direction::tx) return std::nullopt;
  const canid_t id = frame.raw.can_id & (CAN_EFF_FLAG | CAN_EFF_MASK);
  if (id == ego_status_.layout().can_id()) {
    if (!accept(ego_status_, frame)) return std::nullopt;
    EgoState ego;
    ego_status_.decode(frame, [&](std::size_t signal, double value) {
      if (signal == speed_) ego.speed_mps = value;
      if (signal == yaw_rate_) ego.yaw_rate_radps = value;
    });
    controller_.ego_status(frame.time_ns, ego);
    return std::nullopt;
  }
  if (id == object_header_.layout().can_id()) {
    if (accept(object_header_, frame)) return answer(frame);
    reported_.fill(false);  // the list that the frame ended has no valid header
    return std::nullopt;
  }
  for (std::size_t slot = 0; slot < objects_.size(); ++slot) {
    if (id == objects_[slot].layout().can_id() && accept(objects_[slot], frame)) take_object(slot, frame);
  }
  return std::nullopt;
}

bool Station::accept(can::MessageDecoder& decoder, const can::Frame& frame) {
  if (decoder.check(frame) == can::MessageDecoder::Verdict::accepted) return true;
  ++counters_.refused_frames;
  return false;
}

void Station::take_object(std::size_t slot, const can::Frame& frame) {
  std::array<double, 7> values{};
  objects_[slot].decode(frame, [&](std::size_t signal, double value) {
    const auto place = std::find(object_signals_.begin(), object_signals_.end(), signal);
    if (place != object_signals_.end())
      values[static_cast<std::size_t>(place - object_signals_.begin())] = value;
  });
  constexpr double s_per_ms = 0.001;
  reports_[slot] = {values[0] != 0.0, values[1], values[2],           values[3],
                    values[4],        values[5], values[6] * s_per_ms};
  reported_[slot] = true;
}

std::optional<can::Frame> Station::answer(const can::Frame& header) {
  std::size_t count = 0;
  double list_counter = 0.0;
  object_header_.decode(header, [&](std::size_t signal, double value) {
    if (signal == object_count_) count = std::min(static_cast<std::size_t>(value), object_slots);
    if (signal == list_counter_) list_counter = value;
  });
  const bool complete = std::all_of(reported_.begin(), reported_.begin() + static_cast<std::ptrdiff_t>(count),
                                    [](bool reported) { return reported; });
  reported_.fill(false);
  if (!complete) {
    ++counters_.incomplete_lists;
    return std::nullopt;
  }
  const BrakeDecision decision = controller_.object_list(header.time_ns, std::span(reports_).first(count));
  std::vector<double> values(brake_command_.layout().signal_count(), 0.0);
  values[deceleration_] = decision.deceleration_mps2;
  values[warning_] = decision.warning ? 1.0 : 0.0;
  values[degraded_] = decision.degraded ? 1.0 : 0.0;
  values[answer_to_] = list_counter;
  can::MessageEncoder::Tally tally;
  ++counters_.answers;
  return brake_command_.build(values, tally);
}

}  // namespace hil::crossing::aeb
