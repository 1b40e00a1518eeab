// Judges the answer to a contact search: which pairs are listed, and each of them.

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "rtstdb/oracle/contact_pair.hpp"
#include "rtstdb/oracle/contact_surface.hpp"
#include "rtstdb/oracle/judged.hpp"
#include "rtstdb/oracle/oracle.hpp"

namespace rtstdb::oracle {
namespace {

/// Numbers of pairs: those that noise can not change, and all that it may add.
struct PairRange {
  std::uint32_t certain = 0, possible = 0;

  void add(bool is_certain, bool is_possible) {
    certain += is_certain ? 1 : 0;
    possible += is_possible ? 1 : 0;
  }
};

/// Whether an answer without limits lists the pair.
struct PairExpectation {
  bool certain = false;   ///< whatever the error within the precision
  bool exact = false;     ///< without an error
  bool possible = false;  ///< with the most favourable error
};

PairExpectation expected_at(double distance_m, double precision_m, double margin_m) {
  const double beyond_m = distance_m - margin_m;
  return {beyond_m < -precision_m, beyond_m <= 0.0, beyond_m <= precision_m};
}

/// A pair of a search with its truth.
class JudgedPair {
 public:
  virtual ~JudgedPair() = default;
  /// Of a search that names one entity or none.
  virtual PairExpectation expectation() const = 0;
  virtual Judgement judge(const ContactPair& answer) const = 0;
  virtual double distance_m() const = 0;
};

class JudgedConvexPair final : public JudgedPair {
 public:
  JudgedConvexPair(const World& world, const ContactSearch& search, const ContactCandidate& candidate)
      : search_(search) {
    const auto first = world.parts_of(*world.find(candidate.first));
    const auto second = world.parts_of(*world.find(candidate.second));
    for (std::uint32_t a = 0; a < first.size(); ++a) {
      for (std::uint32_t b = 0; b < second.size(); ++b) {
        JudgedParts& parts = parts_.emplace_back();
        parts.pair = posed_parts(world, candidate.first, a, candidate.second, b, search.t);
        parts.truth = pair_truth(parts.pair);
        parts.first_triangles = first[a].triangles;
        parts.second_triangles = second[b].triangles;
      }
    }
    truth_ = std::ranges::min_element(parts_, {}, [](const JudgedParts& one) {
               return one.truth.distance_m;
             })->truth;
  }
  PairExpectation expectation() const override {
    return expected_at(truth_.distance_m, truth_.precision_m, static_cast<double>(search_.margin_m));
  }
  Judgement judge(const ContactPair& answer) const override {
    if (!answer.has_depth) return judged(Verdict::differs, "convex bodies without depth");
    if (parts_.size() == 1) return judge_pair(parts_[0].pair, truth_, search_, answer);
    return judge_parts(parts_, search_, answer);
  }
  double distance_m() const override { return truth_.distance_m; }

 private:
  const ContactSearch& search_;
  std::vector<JudgedParts> parts_;
  PairTruth truth_;  // of the nearest or deepest parts
};

class JudgedSurfacePair final : public JudgedPair {
 public:
  JudgedSurfacePair(const World& world, const ContactSearch& search, const ContactCandidate& candidate)
      : search_(search),
        pair_(world, candidate.first, candidate.second, search.t),
        truth_(surface_truth(pair_)) {}
  PairExpectation expectation() const override {
    PairExpectation expected =
        expected_at(truth_.distance_m, truth_.precision_m, static_cast<double>(search_.margin_m));
    if (truth_.is_contact) expected.exact = expected.possible = true;
    if (truth_.is_certain_contact()) expected.certain = true;
    return expected;
  }
  Judgement judge(const ContactPair& answer) const override {
    return judge_surface_pair(pair_, truth_, search_, answer);
  }
  double distance_m() const override { return truth_.is_contact ? -truth_.min_depth_m : truth_.distance_m; }

 private:
  const ContactSearch& search_;
  SurfacePair pair_;
  SurfaceTruth truth_;
};

std::unique_ptr<const JudgedPair> judged_pair(const World& world, const ContactSearch& search,
                                              const ContactCandidate& candidate) {
  if (is_surface_pair(world, candidate.first, candidate.second))
    return std::make_unique<JudgedSurfacePair>(world, search, candidate);
  return std::make_unique<JudgedConvexPair>(world, search, candidate);
}

std::string name_of(EntityId first, EntityId second) {
  return "entities " + std::to_string(first.index) + " and " + std::to_string(second.index);
}

/// Whether the numbers of the answer fit one another and the options.
Judgement judge_sizes(const ContactQueryOptions& options, const ContactAnswer& answer) {
  if (answer.incomplete) return {Verdict::differs, "no answer: incomplete"};
  if (answer.pairs.size() != std::min(answer.found, options.pairs_per_search))
    return judged(Verdict::differs, "%zu pairs are listed and %u found, where at most %u are listed",
                  answer.pairs.size(), answer.found, options.pairs_per_search);
  if (answer.found > options.pairs_per_search && !answer.overflow)
    return judged(Verdict::differs, "%u found without overflow, where at most %u are listed", answer.found,
                  options.pairs_per_search);
  return {};
}

/// Whether the search alone exceeds what a batch holds. Other searches of the batch may add to it.
bool exceeds_batch(const World& world, const ContactSearch& search, const ContactQueryOptions& options,
                   std::uint32_t candidates) {
  const std::uint32_t max_candidates =
      options.max_candidates != 0 ? options.max_candidates : options.capacity * options.pairs_per_search;
  if (search.first.valid()) return candidates > max_candidates;
  const std::uint32_t mask = search.first_mask | search.second_mask;
  const auto bodies =
      std::ranges::count_if(world.entities(), [&](const EntityState& state) { return visible(state, mask); });
  return candidates > max_candidates || bodies > static_cast<std::ptrdiff_t>(options.max_bodies);
}

/// `batch_overflows`: the search alone exceeds the batch.
Judgement judge_numbers(const ContactQueryOptions& options, const PairRange& candidates,
                        const PairRange& listed, bool batch_overflows, const ContactAnswer& answer) {
  // Overflow has another cause than the length of the list.
  const bool is_short = answer.overflow && answer.found <= options.pairs_per_search;
  if (is_short && options.capacity == 1 && !batch_overflows)
    return judged(Verdict::differs, "overflow at %u candidates and %u found", answer.candidates,
                  answer.found);
  // Candidates that were not tested are not found, and those of bodies left out are not counted.
  const bool all_tested = !answer.overflow || !(is_short || batch_overflows);
  if ((all_tested && answer.candidates < candidates.certain) || answer.candidates > candidates.possible)
    return judged(Verdict::differs, "%u candidates, where there are %u to %u", answer.candidates,
                  candidates.certain, candidates.possible);
  if ((all_tested && answer.found < listed.certain) || answer.found > listed.possible)
    return judged(Verdict::differs, "%u found, where there are %u to %u", answer.found, listed.certain,
                  listed.possible);
  return {};
}

}  // namespace

Judgement compare(const World& world, const ContactSearch& search, const ContactQueryOptions& options,
                  std::span<const ContactCandidate> candidates, const ContactAnswer& answer) {
  if (Judgement judgement = judge_sizes(options, answer); judgement.verdict != Verdict::agrees)
    return judgement;
  const auto listed = answer.pairs;
  std::size_t next = 0;
  PairRange of_candidates;
  PairRange of_listed;
  Judgement close;
  for (const ContactCandidate& candidate : candidates) {
    const bool is_listed = next < listed.size() && listed[next].first == candidate.first &&
                           listed[next].second == candidate.second;
    const bool is_candidate = is_listed || search.second.valid() || candidate.gap_m <= candidate.noise_m;
    of_candidates.add(candidate.gap_m < -candidate.noise_m, is_candidate);
    if (!is_candidate) continue;
    const auto pair = judged_pair(world, search, candidate);
    const PairExpectation expected =
        search.second.valid() ? PairExpectation{true, true, true} : pair->expectation();
    const std::string name = name_of(candidate.first, candidate.second);
    if (is_listed) {
      const Judgement one = pair->judge(listed[next]);
      const bool is_undecided = listed[next].status == PairStatus::undecided;
      of_listed.add(expected.certain, expected.possible || is_undecided);
      ++next;
      if (one.verdict != Verdict::agrees) close = {one.verdict, name + ": " + one.reason};
      if (one.verdict == Verdict::differs) return close;
      if (!expected.possible && !is_undecided) return {Verdict::differs, name + " are listed, far apart"};
      if (!expected.exact && close.verdict == Verdict::agrees)
        close = {Verdict::too_close, name + " are listed, at the border"};
      continue;
    }
    of_listed.add(expected.certain, expected.possible);
    // A list that overflowed says nothing about pairs behind its end.
    if (answer.overflow && next == listed.size()) continue;
    if (!expected.exact) continue;
    const std::string missing = name + " are missing at a distance of " + std::to_string(pair->distance_m());
    if (expected.certain) return {Verdict::differs, missing + " m"};
    close = {Verdict::too_close, missing + " m"};
  }
  if (next != listed.size())
    return {Verdict::differs, "place " + std::to_string(next) + ", " +
                                  name_of(listed[next].first, listed[next].second) +
                                  ": unknown, masked out, far apart, or out of order"};
  const bool batch_overflows = exceeds_batch(world, search, options, of_candidates.possible);
  const Judgement numbers = judge_numbers(options, of_candidates, of_listed, batch_overflows, answer);
  return numbers.verdict == Verdict::agrees ? close : numbers;
}

}  // namespace rtstdb::oracle
