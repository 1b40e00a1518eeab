#include "bench/transactions/commit_load.hpp"

#include <glm/ext/quaternion_double.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <stdexcept>
#include <string>

#include "bench/spatial/scene.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {
namespace {

constexpr std::uint32_t entity_count = 10'000;

bool same_state(const rtstdb::EntityState& a, const rtstdb::EntityState& b) {
  const rtstdb::EntityRow &x = a.row, &y = b.row;
  return a.id == b.id && a.written_by == b.written_by && x.geometry == y.geometry && x.scale == y.scale &&
         x.mask == y.mask && x.material == y.material && x.motion.p_world_m == y.motion.p_world_m &&
         x.motion.q_world == y.motion.q_world && x.motion.v_world_mps == y.motion.v_world_mps &&
         x.motion.w_world_radps == y.motion.w_world_radps && x.motion.valid_from == y.motion.valid_from;
}

void change_the_rest(rtstdb::Motion& motion) {
  const glm::dquat turn(0.9999, 0.008, 0.008, 0.008);
  motion.p_world_m.y += 0.001;
  motion.p_world_m.z += 0.001;
  motion.q_world = glm::normalize(motion.q_world * turn);
  motion.v_world_mps += 0.001;
  motion.w_world_radps += 0.000'1;
  motion.valid_from += rtstdb::Nanoseconds(1);
}

}  // namespace

CommitLoad::CommitLoad(const CommitLoadOptions& options)
    : options_(options), states_(strewn_boxes(entity_count, 23.0f, 20)) {
  open();
  const rtstdb::GeometryId box = world_->add(rtstdb::make_box(glm::dvec3(1.0)));
  for (rtstdb::EntityRow& row : states_)
    row.geometry = box;
  ids_ = world_->create(states_);
}

void CommitLoad::open() {
  world_.emplace(entity_count, 16, options_.spin, options_.durability);
  for (std::uint32_t k = 0; k < options_.transactions; ++k)
    made_.push_back(database().make_transaction({.max_writes = options_.rows}));
}

void CommitLoad::reopen() {
  must(database().close());
  made_.clear();
  world_.reset();
  open();
}

double CommitLoad::rate(int times) {
  const double seconds = seconds_of([&] {
    for (int k = 0; k < times; ++k)
      once();
  });
  return static_cast<double>(made_.size()) * times / seconds;
}

void CommitLoad::once() {
  for (const auto& transaction : made_) {
    transaction->begin({});
    for (std::uint32_t row = 0; row < options_.rows; ++row) {
      rtstdb::Motion& motion = states_[next_].motion;
      motion.p_world_m.x += 0.001;
      if (options_.turns) change_the_rest(motion);
      transaction->update_motion(ids_[next_], motion);
      next_ = (next_ + 1) % entity_count;
    }
    database().submit(*transaction);
  }
  for (const auto& transaction : made_) {
    const rtstdb::Outcome& outcome = database().wait(*transaction);
    if (outcome.status != rtstdb::Status::committed) throw std::runtime_error(rtstdb::describe(outcome));
  }
}

void demand_same_world(rtstdb::Database& a, rtstdb::Database& b) {
  const rtstdb::Version version = a.latest().version;
  if (b.latest().version != version)
    throw std::runtime_error("version " + std::to_string(version) + " here is version " +
                             std::to_string(b.latest().version) + " there");
  const auto here = must(a.snapshot(rtstdb::ReadAt::latest()));
  const auto there = must(b.snapshot(rtstdb::ReadAt::latest()));
  if (here.size() != there.size()) throw std::runtime_error("there are not as many rows there as here");
  const auto differ = std::ranges::mismatch(here, there, same_state);
  if (differ.in1 != here.end())
    throw std::runtime_error("entity " + std::to_string(differ.in1->id.index) + " has another row there");
}

}  // namespace hil::bench
