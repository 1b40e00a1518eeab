#pragma once
// The logic of a PLC that controls the lights of a crossing of two roads. Each scan takes the detectors and
// gives the lights.
//
// A road's light goes green -> yellow -> red; both lights are red for the all-red time; then the other
// light goes red-yellow -> green. Green changes on demand: a detector of the other road saw a vehicle, the
// minimum green is over, and the detectors of this road are empty or its maximum green is over. Without
// demand the lights do not change. An override uses the same sequence. When the heartbeat stops (watchdog),
// green ends at once, through yellow, and both lights stay red until the heartbeat returns.
//
// Threads: one at a time. No allocation, no I/O and no clock: the caller of step() gives the time.

#include <cstdint>

namespace hil::crossing::plc {

enum class Light : std::uint8_t { red = 0, red_yellow = 1, green = 2, yellow = 3 };
enum class Road : std::uint8_t { ego, cross };
enum class Override : std::uint8_t { automatic = 0, ego_green = 1, cross_green = 2, all_red = 3 };

struct Timing {
  std::int64_t minimum_green_ms = 2'000;
  std::int64_t maximum_green_ms = 20'000;  ///< of an occupied road while the other road has demand
  std::int64_t yellow_ms = 3'000;
  std::int64_t all_red_ms = 1'000;
  std::int64_t red_yellow_ms = 1'000;
  std::int64_t watchdog_ms = 2'000;  ///< time without a change of the heartbeat
};

struct Inputs {
  std::uint16_t detector_ego = 0;  ///< vehicles on the loops
  std::uint16_t detector_cross_right = 0;
  std::uint16_t detector_cross_left = 0;
  /// The first change arms the watchdog, so that the PLC also works without a client.
  std::uint16_t heartbeat = 0;
  std::uint16_t override_mode = 0;  ///< an Override; any other number means automatic
};

struct Outputs {
  Light ego = Light::red;
  Light cross = Light::green;
  bool demand_ego = false;  ///< a vehicle was detected since the road's last green
  bool demand_cross = false;
  bool watchdog_fault = false;
  /// Remaining minimum green of the road that has green; below zero: the time since its end. 0 when no road
  /// has green.
  std::int64_t green_remaining_ms = 0;
};

class CrossingLogic {
 public:
  /// Starts with green for the crossing road. Misuse (asserts): a negative time, or a maximum green below the
  /// minimum green.
  explicit CrossingLogic(const Timing& timing);

  /// One scan, `elapsed_ms` (not negative) after the last one. Asserts in every build that at least one
  /// light is red.
  const Outputs& step(const Inputs& inputs, std::int64_t elapsed_ms);
  const Outputs& outputs() const noexcept { return outputs_; }

 private:
  enum class Stage : std::uint8_t { green, yellow, all_red, red_yellow };
  enum class Target : std::uint8_t { ego, cross, none };

  void check_heartbeat(const Inputs& inputs, std::int64_t elapsed_ms);
  void update_demand(const Inputs& inputs);
  Target target_of(const Inputs& inputs) const;
  Target automatic_target(const Inputs& inputs) const;
  void advance(Target target);
  void enter(Stage stage);
  void set_outputs();

  const Timing timing_;
  Road road_ = Road::cross;  ///< has green, gets it next, or had it last
  Stage stage_ = Stage::green;
  std::int64_t in_stage_ms_ = 0;
  bool demand_ego_ = false;
  bool demand_cross_ = false;
  bool heartbeat_known_ = false;
  bool watchdog_armed_ = false;
  bool watchdog_fault_ = false;
  std::uint16_t last_heartbeat_ = 0;
  std::int64_t since_heartbeat_ms_ = 0;
  Outputs outputs_;
};

}  // namespace hil::crossing::plc
