#include "configs/docking/modules/docking_port/port_contact.hpp"

#include <algorithm>
#include <utility>

namespace hil::modules {
namespace {

/// Pairs of convex pieces of both bodies.
constexpr std::uint32_t max_piece_pairs = 16384;

/// An undecided pair is known to be apart if the lower bound of its distance is above 0.
bool is_decided(const rtstdb::ContactPair& pair) {
  return pair.status != rtstdb::PairStatus::undecided || pair.min_distance_m > 0.0f;
}

}  // namespace

rtstdb::Result<std::unique_ptr<PortContact>> PortContact::prepare(rtstdb::Database& database,
                                                                  const std::string& name,
                                                                  rtstdb::EntityId chaser,
                                                                  rtstdb::EntityId ring) {
  std::unique_ptr<PortContact> made(new PortContact(chaser, ring));
  auto query = database.prepare(rtstdb::ContactQueryOptions{
      .name = name, .capacity = 1, .pairs_per_search = 1, .max_candidates = max_piece_pairs});
  if (!query) return query.error();
  made->query_ = std::move(query).value();
  return made;
}

void PortContact::add_to(rtstdb::Transaction& transaction, rtstdb::WorldTime t) noexcept {
  query_->searches()[0] = {.first = chaser_, .second = ring_, .t = t};
  transaction.add_query(*query_, 1);
}

bool PortContact::take(double closing_speed_mps) noexcept {
  const rtstdb::ContactAnswer& answer = std::as_const(*query_).answers()[0];
  const bool is_known =
      !answer.overflow && !answer.incomplete && answer.pairs.size() == 1 && is_decided(answer.pairs[0]);
  const double before_mps = std::exchange(speed_before_mps_, closing_speed_mps);
  if (!is_known) {
    undecided_ += 1.0;
    return false;
  }
  const bool was_touching = is_touching_;
  is_touching_ = answer.pairs[0].status == rtstdb::PairStatus::contact;
  if (!is_touching_ || was_touching) return false;
  touches_ += 1.0;
  speed_mps_ = std::max(before_mps, closing_speed_mps);
  return true;
}

}  // namespace hil::modules
