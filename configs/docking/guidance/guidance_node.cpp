#include "configs/docking/guidance/guidance_node.hpp"

#include <algorithm>
#include <cmath>

#include "io/can/assertion.hpp"

namespace hil::docking::guidance {

namespace {

const can::Protection protected_message{"Counter", "Checksum"};

struct RequiredMessage {
  std::string message;
  std::vector<std::string> signals;
  can::Protection protection;
  can::Use use;
};

std::string target_name(std::size_t slot) {
  return "Target" + std::to_string(slot);
}

std::vector<RequiredMessage> required_messages() {
  std::vector<RequiredMessage> all = {
      {"Attitude", {"QW", "QX", "QY", "QZ"}, {}, can::Use::receive},
      {"Rates", {"WX", "WY", "WZ"}, protected_message, can::Use::receive},
      {"ScanHeader", {"ScanIndex", "TargetCount", "Captured"}, protected_message, can::Use::receive},
      {"ThrustCommand", {"ForceX", "ForceY", "ForceZ"}, protected_message, can::Use::send},
      {"TorqueCommand", {"TorqueX", "TorqueY", "TorqueZ"}, protected_message, can::Use::send},
      {"GuidanceStatus", {"Mode", "Distance", "AnswerTo"}, protected_message, can::Use::send}};
  for (std::size_t slot = 0; slot < GuidanceNode::max_targets; ++slot)
    all.push_back({target_name(slot), {"Azimuth", "Elevation", "Range"}, {}, can::Use::receive});
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

template <std::size_t N>
std::array<std::size_t, N> signal_indices(const can::Dbc& database, const std::string& message,
                                          const char* const (&names)[N]) {
  std::array<std::size_t, N> indices{};
  for (std::size_t i = 0; i < N; ++i)
    indices[i] = signal_index(database, message, names[i]);
  return indices;
}

const can::Dbc& checked(const can::Dbc& database) {
  can::require(GuidanceNode::database_problems(database).empty(),
               "the database has no problems (GuidanceNode::database_problems)");
  return database;
}

/// The values of these signals in a frame; 0 for those that it does not carry.
template <std::size_t N>
std::array<double, N> values_in(const can::MessageDecoder& decoder, const can::Frame& frame,
                                const std::array<std::size_t, N>& signals) {
  std::array<double, N> values{};
  decoder.decode(frame, [&](std::size_t signal, double value) {
    const auto place = std::find(signals.begin(), signals.end(), signal);
    if (place != signals.end()) values[static_cast<std::size_t>(place - signals.begin())] = value;
  });
  return values;
}

}  // namespace

std::vector<std::string> GuidanceNode::database_problems(const can::Dbc& database) {
  std::vector<std::string> problems;
  for (const RequiredMessage& need : required_messages()) {
    const can::DbcMessage* const message = database.find_message(need.message);
    if (message == nullptr) {
      problems.push_back("the database has no message '" + need.message + "'");
      continue;
    }
    for (const std::string& signal : need.signals) {
      if (message->find_signal(signal) == nullptr)
        problems.push_back("message '" + need.message + "' has no signal '" + signal + "'");
    }
    const auto more = can::coding_problems(*message, need.protection, need.use);
    problems.insert(problems.end(), more.begin(), more.end());
  }
  return problems;
}

GuidanceNode::GuidanceNode(const can::Dbc& database, const Parameters& parameters)
    : controller_(parameters),
      attitude_(message_of(checked(database), "Attitude"), can::Protection{}),
      rates_(message_of(database, "Rates"), protected_message),
      scan_header_(message_of(database, "ScanHeader"), protected_message),
      attitude_signals_(signal_indices(database, "Attitude", {"QW", "QX", "QY", "QZ"})),
      rate_signals_(signal_indices(database, "Rates", {"WX", "WY", "WZ"})),
      target_signals_(signal_indices(database, "Target0", {"Azimuth", "Elevation", "Range"})),
      thrust_signals_(signal_indices(database, "ThrustCommand", {"ForceX", "ForceY", "ForceZ"})),
      torque_signals_(signal_indices(database, "TorqueCommand", {"TorqueX", "TorqueY", "TorqueZ"})),
      scan_index_(signal_index(database, "ScanHeader", "ScanIndex")),
      target_count_(signal_index(database, "ScanHeader", "TargetCount")),
      captured_(signal_index(database, "ScanHeader", "Captured")),
      list_counter_(signal_index(database, "ScanHeader", "Counter")),
      mode_(signal_index(database, "GuidanceStatus", "Mode")),
      distance_(signal_index(database, "GuidanceStatus", "Distance")),
      answer_to_(signal_index(database, "GuidanceStatus", "AnswerTo")) {
  for (std::size_t slot = 0; slot < max_targets; ++slot)
    targets_.emplace_back(message_of(database, target_name(slot)), can::Protection{});
  for (const char* message : {"ThrustCommand", "TorqueCommand", "GuidanceStatus"})
    answer_encoders_.emplace_back(message_of(database, message), protected_message);
}

std::span<const can::Frame> GuidanceNode::handle(const can::Frame& frame) {
  if (frame.is_error() || frame.direction == can::Direction::tx) return {};
  const canid_t id = frame.raw.can_id & (CAN_EFF_FLAG | CAN_EFF_MASK);
  if (id == attitude_.layout().can_id()) {
    if (accept(attitude_, frame)) take_attitude(frame);
  } else if (id == rates_.layout().can_id()) {
    if (accept(rates_, frame)) take_rates(frame);
    received_attitude_.reset();
  } else if (id == scan_header_.layout().can_id()) {
    if (accept(scan_header_, frame)) return answer(frame);
    received_.fill(false);  // the list has no valid header
  } else {
    for (std::size_t slot = 0; slot < targets_.size(); ++slot) {
      if (id == targets_[slot].layout().can_id() && accept(targets_[slot], frame)) take_target(slot, frame);
    }
  }
  return {};
}

bool GuidanceNode::accept(can::MessageDecoder& decoder, const can::Frame& frame) {
  if (decoder.check(frame) == can::MessageDecoder::Verdict::accepted) return true;
  ++counters_.refused_frames;
  return false;
}

void GuidanceNode::take_attitude(const can::Frame& frame) {
  const auto [w, x, y, z] = values_in(attitude_, frame, attitude_signals_);
  // A quaternion of another length is no rotation, and is ignored.
  constexpr double tolerance = 1e-3;  // of the length
  if (std::abs(std::sqrt(w * w + x * x + y * y + z * z) - 1.0) > tolerance) return;
  received_attitude_ = glm::dquat(w, x, y, z);
}

void GuidanceNode::take_rates(const can::Frame& frame) {
  if (!received_attitude_) return;
  const auto [x, y, z] = values_in(rates_, frame, rate_signals_);
  controller_.attitude(frame.time_ns, {.q = *received_attitude_, .w_body_radps = {x, y, z}});
}

void GuidanceNode::take_target(std::size_t slot, const can::Frame& frame) {
  const auto [azimuth, elevation, range] = values_in(targets_[slot], frame, target_signals_);
  detections_[slot] = {.azimuth_rad = azimuth, .elevation_rad = elevation, .range_m = range};
  received_[slot] = true;
}

std::span<const can::Frame> GuidanceNode::answer(const can::Frame& header) {
  const auto [scan, targets, captured, counter] =
      values_in(scan_header_, header, std::array{scan_index_, target_count_, captured_, list_counter_});
  const std::size_t count = std::min(static_cast<std::size_t>(targets), max_targets);
  const bool is_complete =
      std::all_of(received_.begin(), received_.begin() + static_cast<std::ptrdiff_t>(count),
                  [](bool received) { return received; });
  received_.fill(false);
  if (!is_complete) {
    ++counters_.incomplete_lists;
    return {};
  }
  encode(controller_.detections(header.time_ns, {.scan = static_cast<std::uint32_t>(scan),
                                                 .detections = std::span(detections_).first(count),
                                                 .docked = captured != 0.0}),
         counter);
  ++counters_.answers;
  return frames_;
}

void GuidanceNode::encode(const Command& command, double list_counter) {
  can::MessageEncoder::Tally tally;
  const auto build = [&](std::size_t index, const auto& signals, const auto& numbers) {
    std::vector<double> values(answer_encoders_[index].layout().signal_count(), 0.0);
    for (std::size_t i = 0; i < signals.size(); ++i)
      values[signals[i]] = numbers[i];
    frames_[index] = answer_encoders_[index].build(values, tally);
  };
  const glm::dvec3& force = command.force_body_n;
  const glm::dvec3& torque = command.torque_body_nm;
  build(0, thrust_signals_, std::array{force.x, force.y, force.z});
  build(1, torque_signals_, std::array{torque.x, torque.y, torque.z});
  build(2, std::array{mode_, distance_, answer_to_},
        std::array{static_cast<double>(command.mode), command.distance_m, list_counter});
}

}  // namespace hil::docking::guidance
