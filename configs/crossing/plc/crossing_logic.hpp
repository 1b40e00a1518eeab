#pragma once
// The lights of a crossing of two roads, as the logic of a PLC: one step per scan, detectors in, lights out.
//
// A road's lights go green -> yellow -> red, all roads stay red for a while, then the other road's go
// red-yellow -> green. Green changes on demand: when the other road's detectors saw a vehicle, the minimum
// green is over, and this road's detectors are empty or its maximum green is over. Without demand the lights
// stay. Overrides take the same way. A lost client (watchdog) ends green at once, through yellow, and keeps
// all lights red until the client is back.
//
// Threads: one at a time. No allocation, no I/O, no clock: time is what step() is told.

#include <cstdint>

namespace hil::crossing::plc {

enum class Light : std::uint8_t { red = 0, red_yellow = 1, green = 2, yellow = 3 };
enum class Road : std::uint8_t { ego, cross };
enum class Override : std::uint8_t { automatic = 0, ego_green = 1, cross_green = 2, all_red = 3 };

struct Timing {
  std::int64_t minimum_green_ms = 2'000;
  std::int64_t maximum_green_ms = 20'000;  ///< of a road that is not empty while the other waits
  std::int64_t yellow_ms = 3'000;
  std::int64_t all_red_ms = 1'000;
  std::int64_t red_yellow_ms = 1'000;
  std::int64_t watchdog_ms = 2'000;  ///< without a new heartbeat
};

struct Inputs {
  std::uint16_t detector_ego = 0;  ///< vehicles on the loops
  std::uint16_t detector_cross_right = 0;
  std::uint16_t detector_cross_left = 0;
  /// The watchdog watches it change. It is armed by the first change, so that the PLC runs without a client,
  /// too.
  std::uint16_t heartbeat = 0;
  std::uint16_t override_mode = 0;  ///< an Override; other numbers mean automatic
};

struct Outputs {
  Light ego = Light::red;
  Light cross = Light::green;
  bool demand_ego = false;  ///< a vehicle waits or waited for green
  bool demand_cross = false;
  bool watchdog_fault = false;
  /// Of the minimum green of the road that has green; below zero: for how long it has been over. 0 when no
  /// road has green.
  std::int64_t green_remaining_ms = 0;
};

class CrossingLogic {
 public:
  /// Starts with green for the crossing road. Misuse (asserts): a negative time.
  explicit CrossingLogic(const Timing& timing);

  /// One scan; `elapsed_ms` since the last (not negative). Asserts, always on, that never both roads have
  /// other than red.
  const Outputs& step(const Inputs& inputs, std::int64_t elapsed_ms);
  const Outputs& outputs() const noexcept { return outputs_; }

 private:
  enum class Stage : std::uint8_t { green, yellow, all_red, red_yellow };
  enum class Target : std::uint8_t { ego, cross, none };

  void watch(const Inputs& inputs, std::int64_t elapsed_ms);
  void remember_demand(const Inputs& inputs);
  Target target_of(const Inputs& inputs) const;
  Target automatic_target(const Inputs& inputs) const;
  void advance(Target target);
  void enter(Stage stage);
  void show();

  const Timing timing_;
  Road road_ = Road::cross;  ///< has green, is about to, or had it last
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
