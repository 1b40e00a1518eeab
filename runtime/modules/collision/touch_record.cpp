#include "runtime/modules/collision/touch_record.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <utility>

namespace hil::modules {
namespace {

glm::dvec3 in_frame_of(const rtstdb::Pose& pose, const glm::dvec3& p_world_m) {
  return glm::conjugate(pose.q_world) * (p_world_m - pose.p_world_m);
}

}  // namespace

TouchRecord::TouchRecord(World& world, EventLog& events, std::string body)
    : world_(world), database_(world.database()), body_(std::move(body)) {
  poses_ = database_.make_transaction({.max_reads = 2});
  touches_.reserve(max_touches);
  touches_at_ = events.add_kind(body_ + " is touched at a closing speed of {} m/s", 2);
}

void TouchRecord::note(WorldStep& context, const rtstdb::ContactPair& pair) noexcept {
  if (pair.point_count == 0) return;
  const rtstdb::ContactPoint& point = pair.points[0];
  const double speed_mps = -glm::dot(glm::dvec3(point.v_relative_mps), glm::dvec3(point.n_world));
  context.events->note(touches_at_, context.time_ns, speed_mps);
  if (touches_.size() == max_touches) {
    ++not_listed_;
    return;
  }
  poses_->begin({.deadline_class = context.read_class,
                 .deadline = context.deadline,
                 .importance = rtstdb::max_importance,
                 .world_time = {},
                 .read_at = rtstdb::ReadAt::pinned(context.version)});
  poses_->read(pair.first);
  poses_->read(pair.second);
  const bool done = context.execute(database_, *poses_).done();
  if (!done || poses_->state(0) == nullptr || poses_->state(1) == nullptr) {
    ++not_listed_;
    return;
  }
  const rtstdb::Pose first = rtstdb::pose_at(poses_->state(0)->row.motion, context.world_time());
  const rtstdb::Pose second = rtstdb::pose_at(poses_->state(1)->row.motion, context.world_time());
  const glm::dvec3 place_m = first.p_world_m + glm::dvec3(point.p_first_m);
  touches_.push_back({.time_ns = context.time_ns,
                      .entity = pair.second,
                      .place_m = place_m,
                      .on_body_m = in_frame_of(first, place_m),
                      .on_other_m = in_frame_of(second, place_m),
                      .closing_speed_mps = speed_mps,
                      .depth_m = static_cast<double>(point.depth_m)});
}

void TouchRecord::add_to(contribution::Contribution& report, const std::string& instance) const {
  if (touches_.empty() && not_listed_ == 0) return;
  const auto number = [](const std::string& title, const char* unit, int decimals) {
    return contribution::Column{.title = title, .numeric = true, .unit = unit, .decimals = decimals};
  };
  contribution::Table table{.columns = {{.title = "Body"}, number("Run time", "s", 3)}, .rows = {}};
  for (const char* frame : {"World", "This body", "Other body"}) {
    for (const char* axis : {"x", "y", "z"})
      table.columns.push_back(number(std::string(frame) + " " + axis, "m", 2));
  }
  table.columns.push_back(number("Closing speed", "m/s", 2));
  table.columns.push_back(number("Depth", "mm", 1));
  for (const Touch& touch : touches_) {
    std::vector<contribution::Cell> row{{.text = world_.name_of(touch.entity)},
                                        {.number = static_cast<double>(touch.time_ns) * 1e-9}};
    for (const glm::dvec3& place : {touch.place_m, touch.on_body_m, touch.on_other_m}) {
      for (int axis = 0; axis < 3; ++axis)
        row.push_back({.number = place[axis]});
    }
    row.push_back({.number = touch.closing_speed_mps});
    row.push_back({.number = 1e3 * touch.depth_m});
    table.rows.push_back(std::move(row));
  }
  report.sections.push_back(
      {.name = "touches_" + instance,
       .title = "Where bodies touched " + body_,
       .text =
           "The deepest point of each contact in the step in which it was found: in the world, and in the "
           "frames of both bodies. " +
           (not_listed_ == 0 ? std::string() : std::to_string(not_listed_) + " more are not listed."),
       .pictures = {},
       .plots = {},
       .tables = {std::move(table)}});
}

}  // namespace hil::modules
