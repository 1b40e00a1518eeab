#include "rtstdb/scheduler/cost_model.hpp"

#include <algorithm>
#include <cmath>

namespace rtstdb::scheduler {

namespace {

/// Elements per chunk of a cost class that was never run, and elements of its first chunk.
constexpr double unmeasured_per_chunk = 4096.0;
constexpr double unmeasured_first_chunk = 64.0;

/// Fraction of a chunk that the first chunk of a known query gets: others of the batch may cost more.
constexpr double max_first_fraction = 0.5;

/// Shorter chunks would be mostly dispatch. The estimated cost of an element includes its dispatch, so chunks
/// would become smaller and smaller.
constexpr Nanoseconds min_chunk{200'000};

/// Fewer elements are not divided because of what others cost: what seems expensive may be time that the
/// operating system took, and dividing them would double their cost.
constexpr std::uint32_t min_divided = 512;

/// What a run that was stopped would have cost is known up to this factor.
constexpr double clearly_more = 1.1;

/// A query that caused structure work in a larger share of its runs is expected to cause it.
constexpr double rare_structures = 0.02;

/// Weight of the last run in QueryCosts::structures_share.
constexpr double structures_weight = 0.1;

double positions_of(const store::WriteSet& writes) noexcept {
  double sum = 0.0;
  for (const store::ShapeWrite& shape : writes.shapes)
    sum += static_cast<double>(shape.given);
  return sum;
}

/// Sums up parts that execute one after the other.
class Sum {
 public:
  void add(const CostLine& line, double count, bool is_required = true) noexcept {
    const double promised = line.promised_ns(count);
    mean_ns_ += line.predict_ns(count);
    promised_ns_ += promised;
    if (is_required) required_ns_ += promised;
  }
  Prediction prediction() const noexcept {
    return {Nanoseconds(std::llround(mean_ns_)), Nanoseconds(std::llround(promised_ns_)),
            Nanoseconds(std::llround(required_ns_))};
  }

 private:
  double mean_ns_ = 0.0, promised_ns_ = 0.0, required_ns_ = 0.0;
};

}  // namespace

bool CostModel::has_own_line(const query::Request& request) const noexcept {
  const QueryCosts* const costs = queries_.find(request.query->id);
  return costs != nullptr && costs->line.samples() >= min_query_samples;
}

const CostLine& CostModel::line_of(const query::Request& request) const noexcept {
  const QueryCosts* const costs = queries_.find(request.query->id);
  return costs != nullptr && costs->line.samples() >= min_query_samples ? costs->line : class_line(request);
}

std::optional<Prediction> CostModel::predict(const store::WriteSet& writes,
                                             std::span<const query::Request> requests) const noexcept {
  if (writes_.samples() < min_samples) return std::nullopt;
  Sum sum;
  sum.add(writes_, static_cast<double>(writes.writes.size()));
  if (!writes.shapes.empty()) {
    if (positions_.samples() < min_samples) return std::nullopt;
    sum.add(positions_, positions_of(writes));
  }
  for (const query::Request& request : requests) {
    if (class_line(request).samples() < min_samples) return std::nullopt;
    sum.add(line_of(request), request.count, !writes.empty() || request.query->late() != LatePolicy::partial);
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
    work.refitted = std::ranges::any_of(requests, [this](const query::Request& request) {
      const QueryCosts* const costs = queries_.find(request.query->id);
      return costs != nullptr && costs->structures_share > rare_structures;
    });
    return work;
  }
  const auto creates_or_removes = [](const store::Write& write) {
    return write.kind == store::WriteKind::create || write.kind == store::WriteKind::remove;
  };
  work.built = std::ranges::any_of(writes.writes, creates_or_removes);
  work.refitted = !work.built;
  work.rows = static_cast<std::uint32_t>(writes.writes.size());
  work.entities = entities_ + work.rows;
  work.shapes = static_cast<std::uint32_t>(writes.shapes.size());
  return work;
}

CostModel::Pieces CostModel::longest_pieces() const noexcept {
  const double trees_ns = std::max(builds_.promised_ns(entities_), refits_.promised_ns(max_refitted_rows_));
  const double commit_ns = writes_.promised_ns(max_rows_) + positions_.promised_ns(max_positions_);
  return {.structures = Nanoseconds(std::llround(trees_ns + shapes_.promised_ns(max_shapes_))),
          .commit = Nanoseconds(std::llround(commit_ns))};
}

Nanoseconds CostModel::chunk_time(Nanoseconds half) noexcept {
  return std::max(half, min_chunk);
}

void CostModel::divide(std::span<query::Request> requests, Nanoseconds half) const noexcept {
  double chunks = 0.0;
  for (query::Request& request : requests) {
    request.chunk_time = chunk_time(half);
    const auto chunk_ns = static_cast<double>(request.chunk_time.count());
    const CostLine& line = line_of(request);
    const double element_ns = line.element_ns(request.count);
    const bool is_known = element_ns > 0.0;
    const double per_chunk = is_known ? std::clamp(chunk_ns / element_ns, 1.0, 1e9) : unmeasured_per_chunk;
    request.per_chunk = static_cast<std::uint32_t>(per_chunk);
    request.initial_chunk_fraction = 1.0;
    if (request.count >= min_divided && is_known)
      request.initial_chunk_fraction = std::min(element_ns / line.worst_element_ns(request.count), 1.0);
    // The cost of other queries of the class says little.
    if (!is_known || (request.count >= min_divided && !has_own_line(request)))
      request.initial_chunk_fraction =
          std::min(request.initial_chunk_fraction, unmeasured_first_chunk / per_chunk);
    chunks += request.count / (per_chunk * request.initial_chunk_fraction);
  }
  for (query::Request& request : requests) {
    request.initial_chunk_fraction = std::min(request.initial_chunk_fraction, max_first_fraction);
    if (chunks <= 2.0) request.per_chunk = 0;
  }
}

void CostModel::update_from_worst_elements(std::span<const query::Request> requests, Nanoseconds cost,
                                           const query::StructureWork& structures) noexcept {
  double predicted_ns = 0.0;
  for (const query::Request& request : requests)
    predicted_ns += line_of(request).predict_ns(request.count);
  const double ratio = predicted_ns > 0.0 ? static_cast<double>(cost.count()) / predicted_ns : 0.0;
  for (const query::Request& request : requests) {
    if (request.count < min_divided) continue;
    const double chunk_ns = static_cast<double>(request.chunk_time.count());
    double element_ns = 0.0;
    if (request.per_chunk > 0) {
      element_ns = request.query->worst_cost_ratio * chunk_ns / request.per_chunk;
    } else if (!structures.any()) {
      element_ns = ratio * line_of(request).element_ns(request.count);
    }
    class_line(request).update_from_worst_element(request.count, element_ns);
    queries_.use(request.query->id).line.update_from_worst_element(request.count, element_ns);
  }
}

void CostModel::update_from_writes(const store::WriteSet& writes, Nanoseconds cost) noexcept {
  const auto rows = static_cast<double>(writes.writes.size());
  const auto cost_ns = static_cast<double>(cost.count());
  max_rows_ = std::max(max_rows_, rows);
  max_positions_ = std::max(max_positions_, positions_of(writes));
  if (writes.shapes.empty()) {
    writes_.update(rows, cost_ns);
  } else {
    positions_.update(positions_of(writes), std::max(0.0, cost_ns - writes_.predict_ns(rows)));
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

void CostModel::update_from_stopped(std::span<const query::Request> requests, Nanoseconds cost,
                                    const query::StructureWork& structures) noexcept {
  double structures_ns = 0.0;
  for (const Part& part : parts_of(structures))
    if (part.line != nullptr) structures_ns += part.line->predict_ns(part.count);
  double queries_ns = 0.0;
  double answered = 0.0;  // weighted by the predicted cost of the elements where that is known
  double whole = 0.0;
  const bool all_known = std::ranges::all_of(
      requests, [&](const query::Request& request) { return line_of(request).samples() > 0; });
  for (const query::Request& request : requests) {
    const double request_ns = line_of(request).predict_ns(request.count);
    const double weight = all_known ? request_ns : request.count;
    queries_ns += request_ns;
    whole += weight;
    if (request.count > 0)
      answered += weight * std::min(request.query->answered(), request.count) / request.count;
  }
  const auto cost_ns = static_cast<double>(cost.count());
  const double predicted_ns = structures_ns + queries_ns;
  double whole_ns = cost_ns;
  if (answered > 0.0) {
    whole_ns = structures_ns + std::max(0.0, cost_ns - structures_ns) * whole / answered;
    // Where few were answered, time that the operating system took is not to be scaled up.
    if (all_known)
      whole_ns = std::clamp(whole_ns, cost_ns, std::max(cost_ns, CostLine::max_above * predicted_ns));
  }
  // Otherwise work that never completes would never be predicted, and so never be refused.
  const bool is_first_estimate =
      answered > 0.0 && std::ranges::any_of(requests, [&](const query::Request& request) {
        return class_line(request).samples() < min_samples;
      });
  if (whole_ns > clearly_more * predicted_ns || is_first_estimate) {
    const double learned_ns = std::max(whole_ns, predicted_ns);
    update_from_queries(requests, Nanoseconds(std::llround(learned_ns)), structures);
  }
}

void CostModel::update_from_queries(std::span<const query::Request> requests, Nanoseconds cost,
                                    const query::StructureWork& structures) noexcept {
  const StructureParts parts = parts_of(structures);
  double known_ns = 0.0;
  double unknown = 0.0;
  double count_of_parts = 0.0;
  const auto add = [&](const CostLine& line, double count) {
    known_ns += line.predict_ns(count);
    unknown += line.samples() == 0 ? 1.0 : 0.0;
    count_of_parts += 1.0;
  };
  for (const query::Request& request : requests)
    add(line_of(request), request.count);
  for (const Part& part : parts) {
    if (part.line != nullptr) add(*part.line, part.count);
  }
  const auto cost_ns = static_cast<double>(cost.count());
  const double left_ns = std::max(0.0, cost_ns - known_ns);
  const auto share_ns = [&](const CostLine& line, double count) {
    if (line.samples() == 0) return left_ns / unknown;
    if (known_ns <= 0.0) return unknown > 0.0 ? 0.0 : cost_ns / count_of_parts;
    const double predicted_ns = line.predict_ns(count);
    return unknown > 0.0 && known_ns < cost_ns ? predicted_ns : predicted_ns * cost_ns / known_ns;
  };
  // All shares first: an update changes the predictions from which they are computed.
  std::array<double, max_structure_parts> structure_ns{};
  for (std::size_t k = 0; k < parts.size(); ++k) {
    if (parts[k].line != nullptr) structure_ns[k] = share_ns(*parts[k].line, parts[k].count);
  }
  for (const query::Request& request : requests) {
    const double request_ns = share_ns(line_of(request), request.count);
    queries_.use(request.query->id).last_share_ns = request_ns;
  }
  for (std::size_t k = 0; k < parts.size(); ++k) {
    if (parts[k].line != nullptr) parts[k].line->update(parts[k].count, structure_ns[k]);
  }
  for (const query::Request& request : requests) {
    QueryCosts* const costs = queries_.find(request.query->id);
    if (costs == nullptr) continue;  // another query of this run has taken its place
    class_line(request).update(request.count, costs->last_share_ns);
    costs->line.update(request.count, costs->last_share_ns);
    costs->structures_share += structures_weight * ((structures.any() ? 1.0 : 0.0) - costs->structures_share);
  }
  if (structures.entities > 0) entities_ = structures.entities;
  if (structures.refitted) max_refitted_rows_ = std::max<double>(max_refitted_rows_, structures.rows);
  max_shapes_ = std::max<double>(max_shapes_, structures.shapes);
}

}  // namespace rtstdb::scheduler
