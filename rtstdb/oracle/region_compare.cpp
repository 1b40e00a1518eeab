// Judges the answers to regions and overlaps by the gaps of the candidates.

#include <cmath>

#include "rtstdb/oracle/judged.hpp"
#include "rtstdb/oracle/oracle.hpp"

namespace rtstdb::oracle {
namespace {

EntityId id_of(const EntityGap& gap) {
  return gap.entity;
}
EntityTriangle id_of(const TriangleGap& gap) {
  return {gap.entity, gap.triangle};
}

template <class Gap>
auto ids_found(std::span<const Gap> gaps) {
  std::vector<decltype(id_of(gaps[0]))> ids;
  for (const Gap& gap : gaps) {
    if (gap.gap_m <= 0.0) ids.push_back(id_of(gap));
  }
  return ids;
}

std::string describe(EntityId id) {
  return "entity " + std::to_string(id.index);
}
std::string describe(const EntityTriangle& id) {
  return describe(id.entity) + ", triangle " + std::to_string(id.triangle);
}

/// `listed`: the answer's list of entities or triangles.
template <class Gap, class Id>
Judgement judge(std::span<const Gap> truth, std::span<const Id> listed, const RegionAnswer& answer) {
  if (answer.incomplete) return {Verdict::differs, "no answer: incomplete"};
  if (answer.entities.size() + answer.triangles.size() != listed.size())
    return {Verdict::differs, "entities and triangles are listed"};
  if (answer.overflow ? listed.size() >= answer.found : listed.size() != answer.found)
    return judged(Verdict::differs, "%zu listed and %u found", listed.size(), answer.found);
  std::size_t next = 0;
  std::uint32_t exact = 0;
  std::uint32_t certain = 0;
  std::uint32_t possible = 0;
  bool close = false;
  for (const Gap& gap : truth) {
    const bool exhausted = next == listed.size();
    const bool is_listed = !exhausted && listed[next] == id_of(gap);
    if (is_listed) ++next;
    if (gap.gap_m <= 0.0) ++exact;
    if (gap.gap_m < -gap.noise_m) ++certain;
    if (gap.gap_m <= gap.noise_m) ++possible;
    // A list that overflowed says nothing about ids behind its end.
    if (answer.overflow && exhausted) continue;
    if (is_listed == (gap.gap_m <= 0.0)) continue;
    if (std::abs(gap.gap_m) <= gap.noise_m) {
      close = true;
      continue;
    }
    return judged(Verdict::differs, "%s is %s, where its gap is %.9g m", describe(id_of(gap)).c_str(),
                  is_listed ? "listed" : "missing", gap.gap_m);
  }
  if (next != listed.size())
    return {Verdict::differs, "place " + std::to_string(next) + " lists " + describe(listed[next]) +
                                  ", which is unknown, masked out, far away, or out of order"};
  if (answer.found < certain || answer.found > possible)
    return judged(Verdict::differs, "%u found, where at least %u are", answer.found, certain);
  if (close || answer.found != exact)
    return {Verdict::too_close, "something at the border is counted otherwise"};
  return {};
}

}  // namespace

std::vector<EntityId> found(std::span<const EntityGap> gaps) {
  return ids_found(gaps);
}

std::vector<EntityTriangle> found(std::span<const TriangleGap> gaps) {
  return ids_found(gaps);
}

Judgement compare(std::span<const EntityGap> truth, const RegionAnswer& answer) {
  return judge(truth, answer.entities, answer);
}

Judgement compare(std::span<const TriangleGap> truth, const RegionAnswer& answer) {
  return judge(truth, answer.triangles, answer);
}

}  // namespace rtstdb::oracle
