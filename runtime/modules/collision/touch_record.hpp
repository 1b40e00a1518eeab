#pragma once
// Where bodies touched a body: the place on both, and the closing speed. For an event and a table of the
// report.
//
// Threads: creation while configuring; note in the tick, without allocation; add_to after the last tick.

#include <glm/ext/vector_double3.hpp>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <hil/world/world_module.hpp>
#include <rtstdb/contact.hpp>

namespace hil::modules {

class TouchRecord {
 public:
  /// Touches that the table lists; the section gives the number of further ones.
  static constexpr std::size_t max_touches = 256;

  /// `body`: the first entity of the pairs. `world` outlives it.
  TouchRecord(World& world, EventLog& events, std::string body);

  /// Records a touch that begins at the step's time, with the pair's deepest point. Does nothing for a pair
  /// without points. A touch whose poses can not be read is not listed.
  void note(WorldStep& context, const rtstdb::ContactPair& pair) noexcept;
  /// Adds a section if there was a touch.
  void add_to(contribution::Contribution& report, const std::string& instance) const;

 private:
  struct Touch {
    std::int64_t time_ns = 0;
    rtstdb::EntityId entity{};                   ///< the other body
    glm::dvec3 place_m{0.0};                     ///< world frame
    glm::dvec3 on_body_m{0.0}, on_other_m{0.0};  ///< in the frames of the bodies
    double closing_speed_mps = 0.0;
    double depth_m = 0.0;
  };

  const World& world_;
  rtstdb::Database& database_;
  const std::string body_;
  std::unique_ptr<rtstdb::Transaction> poses_;
  std::vector<Touch> touches_;
  std::uint64_t not_listed_ = 0;
  EventLog::Kind touches_at_;
};

}  // namespace hil::modules
