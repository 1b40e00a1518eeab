#include "rtstdb/transaction/cost_model.hpp"

#include <algorithm>
#include <cmath>

namespace rtstdb::transaction {

namespace {

/// As many elements of a kind that was never asked are thought to fill a chunk, which begins with few of them.
constexpr double unmeasured = 4096.0;
constexpr double first_unmeasured = 64.0;

/// Where it was, with so much of a chunk: others of the batch may cost more, and chunks of two sizes tell dispatches from elements.
constexpr double first_of_known = 0.5;

/// Chunks that are thought to take less are mostly what a dispatch takes by itself. As their elements' cost is learnt with it, chunks
/// would become ever smaller.
constexpr Nanoseconds min_chunk{200'000};

/// Fewer elements than this are not divided for what others cost: what seems dear may be what the operating system took, and to divide
/// them would double what they take.
constexpr std::uint32_t few_elements = 512;

/// What a run that was given up would have cost is known so well.
constexpr double clearly_more = 1.1;

/// A query that needs structures brought up more often than this is expected to need them.
constexpr double seldom = 0.02;

double positions_of(const store::WriteSet& writes) noexcept {
  double sum = 0.0;
  for (const store::ShapeWrite& shape : writes.shapes)
    sum += static_cast<double>(shape.given);
  return sum;
}

/// Sums up parts that take place one after the other.
class Sum {
 public:
  void add(const query::CostSamples& samples, double count, bool is_needed = true) noexcept {
    const double promised = promised_ns(samples, count);
    mean_ns_ += predict_ns(samples, count);
    promised_ns_ += promised;
    if (is_needed) needed_ns_ += promised;
  }
  Prediction prediction() const noexcept {
    return {Nanoseconds(std::llround(mean_ns_)), Nanoseconds(std::llround(promised_ns_)),
            Nanoseconds(std::llround(needed_ns_))};
  }

 private:
  double mean_ns_ = 0.0, promised_ns_ = 0.0, needed_ns_ = 0.0;
};

}  // namespace

std::optional<Prediction> CostModel::predict(const store::WriteSet& writes,
                                             std::span<const query::Request> requests) const noexcept {
  if (writes_.samples < samples_needed) return std::nullopt;
  Sum sum;
  sum.add(writes_, static_cast<double>(writes.writes.size()));
  if (!writes.shapes.empty()) {
    if (positions_.samples < samples_needed) return std::nullopt;
    sum.add(positions_, positions_of(writes));
  }
  for (const query::Request& request : requests) {
    const query::CostSamples& samples = of(request);
    if (of_kind(request).samples < samples_needed) return std::nullopt;
    sum.add(samples, request.count, !writes.empty() || request.query->late() != LatePolicy::partial);
  }
  const query::StructureWork structures = expected(writes, requests);
  if (structures.refitted) sum.add(refits_, structures.rows);
  if (structures.built) sum.add(builds_, structures.entities);
  if (structures.shapes > 0) sum.add(shapes_, structures.shapes);
  return sum.prediction();
}

query::StructureWork CostModel::expected(const store::WriteSet& writes,
                                         std::span<const query::Request> requests) const noexcept {
  query::StructureWork work;
  if (requests.empty()) return work;
  if (writes.empty()) {
    work.refitted = std::ranges::any_of(
        requests, [](const query::Request& request) { return request.query->structures > seldom; });
    return work;
  }
  const auto comes_or_goes = [](const store::Write& write) {
    return write.kind == store::WriteKind::create || write.kind == store::WriteKind::remove;
  };
  work.built = std::ranges::any_of(writes.writes, comes_or_goes);
  work.refitted = !work.built;
  work.rows = static_cast<std::uint32_t>(writes.writes.size());
  work.entities = entities_ + work.rows;
  work.shapes = static_cast<std::uint32_t>(writes.shapes.size());
  return work;
}

CostModel::Pieces CostModel::longest_pieces() const noexcept {
  const double trees_ns = std::max(promised_ns(builds_, entities_), promised_ns(refits_, max_refitted_rows_));
  return {.structures = Nanoseconds(std::llround(trees_ns + promised_ns(shapes_, max_shapes_))),
          .commit = Nanoseconds(
              std::llround(promised_ns(writes_, max_rows_) + promised_ns(positions_, max_positions_)))};
}

Nanoseconds CostModel::chunk_time(Nanoseconds half) noexcept {
  return std::max(half, min_chunk);
}

void CostModel::divide(std::span<query::Request> requests, Nanoseconds chunk) const noexcept {
  double chunks = 0.0;
  for (query::Request& request : requests) {
    request.chunk_time = chunk_time(chunk);
    const auto chunk_ns = static_cast<double>(request.chunk_time.count());
    const query::CostSamples& samples = of(request);
    const double learnt_ns = per_element_ns(samples, request.count);
    const bool is_known = learnt_ns > 0.0;
    const double most = is_known ? std::clamp(chunk_ns / learnt_ns, 1.0, 1e9) : unmeasured;
    request.per_chunk = static_cast<std::uint32_t>(most);
    request.initial_chunk_fraction = 1.0;
    if (request.count >= few_elements && is_known)
      request.initial_chunk_fraction = std::min(learnt_ns / dearest_element_ns(samples, request.count), 1.0);
    // What others of the kind cost says little.
    if (!is_known || (request.count >= few_elements && request.query->cost.samples < own_samples_needed))
      request.initial_chunk_fraction = std::min(request.initial_chunk_fraction, first_unmeasured / most);
    chunks += request.count / (most * request.initial_chunk_fraction);
  }
  for (query::Request& request : requests) {
    request.initial_chunk_fraction = std::min(request.initial_chunk_fraction, first_of_known);
    if (chunks <= 2.0) request.per_chunk = 0;
  }
}

void CostModel::learn_dearest(std::span<const query::Request> requests, Nanoseconds cost,
                              const query::StructureWork& structures) noexcept {
  double predicted_ns = 0.0;
  for (const query::Request& request : requests)
    predicted_ns += predict_ns(of(request), request.count);
  const double whole = predicted_ns > 0.0 ? static_cast<double>(cost.count()) / predicted_ns : 0.0;
  for (const query::Request& request : requests) {
    if (request.count < few_elements) continue;
    const double chunk_ns = static_cast<double>(request.chunk_time.count());
    const double element_ns = request.per_chunk > 0
                                  ? request.query->worst_cost_ratio * chunk_ns / request.per_chunk
                              : structures.any() ? 0.0
                                                 : whole * per_element_ns(of(request), request.count);
    transaction::learn_dearest(kinds_[static_cast<std::size_t>(request.query->kind())], request.count,
                               element_ns);
    transaction::learn_dearest(request.query->cost, request.count, element_ns);
  }
}

void CostModel::learn_writes(const store::WriteSet& writes, Nanoseconds cost) noexcept {
  const auto rows = static_cast<double>(writes.writes.size());
  const auto cost_ns = static_cast<double>(cost.count());
  max_rows_ = std::max(max_rows_, rows);
  max_positions_ = std::max(max_positions_, positions_of(writes));
  if (writes.shapes.empty()) {
    learn(writes_, rows, cost_ns);
  } else {
    learn(positions_, positions_of(writes), std::max(0.0, cost_ns - predict_ns(writes_, rows)));
  }
}

CostModel::StructureParts CostModel::parts_of(const query::StructureWork& structures) noexcept {
  StructureParts parts;
  if (structures.built) {
    parts[0] = {&builds_, static_cast<double>(structures.entities)};
  } else if (structures.refitted) {
    parts[1] = {&refits_, static_cast<double>(structures.rows)};
  }
  if (structures.shapes > 0) parts[2] = {&shapes_, static_cast<double>(structures.shapes)};
  return parts;
}

void CostModel::learn_stopped(std::span<const query::Request> requests, Nanoseconds cost,
                              const query::StructureWork& structures) noexcept {
  double structures_ns = 0.0;
  for (const Part& part : parts_of(structures))
    if (part.samples != nullptr) structures_ns += predict_ns(*part.samples, part.count);
  double foreseen_ns = 0.0;
  double answered = 0.0;  // by what elements were foreseen to cost, where that is known
  double whole = 0.0;
  const bool all_known =
      std::ranges::all_of(requests, [&](const query::Request& request) { return of(request).samples > 0; });
  for (const query::Request& request : requests) {
    const double own_ns = predict_ns(of(request), request.count);
    const double weight = all_known ? own_ns : request.count;
    foreseen_ns += own_ns;
    whole += weight;
    if (request.count > 0)
      answered += weight * std::min(request.query->answered(), request.count) / request.count;
  }
  const auto cost_ns = static_cast<double>(cost.count());
  const double predicted_ns = structures_ns + foreseen_ns;
  double whole_ns = cost_ns;
  if (answered > 0.0) {
    whole_ns = structures_ns + std::max(0.0, cost_ns - structures_ns) * whole / answered;
    // What the operating system took while few were answered is not what all of them cost.
    if (all_known) whole_ns = std::clamp(whole_ns, cost_ns, std::max(cost_ns, max_above * predicted_ns));
  }
  if (whole_ns > clearly_more * predicted_ns)
    learn_queries(requests, Nanoseconds(std::llround(whole_ns)), structures);
}

void CostModel::learn_queries(std::span<const query::Request> requests, Nanoseconds cost,
                              const query::StructureWork& structures) noexcept {
  const StructureParts parts = parts_of(structures);
  double known_ns = 0.0;
  double unknown = 0.0;
  double count_of_parts = 0.0;
  const auto look = [&](const query::CostSamples& samples, double count) {
    known_ns += predict_ns(samples, count);
    unknown += samples.samples == 0 ? 1.0 : 0.0;
    count_of_parts += 1.0;
  };
  for (const query::Request& request : requests)
    look(of(request), request.count);
  for (const Part& part : parts) {
    if (part.samples != nullptr) look(*part.samples, part.count);
  }
  const auto cost_ns = static_cast<double>(cost.count());
  const double left_ns = std::max(0.0, cost_ns - known_ns);
  const auto share_ns = [&](const query::CostSamples& samples, double count) {
    if (samples.samples == 0) return left_ns / unknown;
    if (known_ns <= 0.0) return unknown > 0.0 ? 0.0 : cost_ns / count_of_parts;
    const double own_ns = predict_ns(samples, count);
    return unknown > 0.0 && known_ns < cost_ns ? own_ns : own_ns * cost_ns / known_ns;
  };
  // Shares first: what is learned changes the predictions that they are made of.
  std::array<double, max_structure_parts> structure_ns{};
  for (std::size_t k = 0; k < parts.size(); ++k) {
    if (parts[k].samples != nullptr) structure_ns[k] = share_ns(*parts[k].samples, parts[k].count);
  }
  for (const query::Request& request : requests)
    request.query->share_ns = share_ns(of(request), request.count);
  for (std::size_t k = 0; k < parts.size(); ++k) {
    if (parts[k].samples != nullptr) learn(*parts[k].samples, parts[k].count, structure_ns[k]);
  }
  for (const query::Request& request : requests) {
    learn(kinds_[static_cast<std::size_t>(request.query->kind())], request.count, request.query->share_ns);
    learn(request.query->cost, request.count, request.query->share_ns);
    request.query->structures += 0.1 * ((structures.any() ? 1.0 : 0.0) - request.query->structures);
  }
  if (structures.entities > 0) entities_ = structures.entities;
  if (structures.refitted) max_refitted_rows_ = std::max<double>(max_refitted_rows_, structures.rows);
  max_shapes_ = std::max<double>(max_shapes_, structures.shapes);
}

}  // namespace rtstdb::transaction
