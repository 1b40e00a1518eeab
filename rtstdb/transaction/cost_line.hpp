#pragma once
// What count of something costs: a weighted least-squares line over samples that fade. It never falls and never goes
// below zero. Beside it stands how far the last samples lay above it. No allocation.

#include "rtstdb/query/executor.hpp"

namespace rtstdb::transaction {

/// So far above their line samples are looked at; what lies farther is what the operating system did.
inline constexpr double max_above = 4.0;

void learn(query::CostSamples& samples, double count, double cost_ns) noexcept;
/// Elements cost so much in a part of a run: what is far above the line is kept, until it has faded.
void learn_dearest(query::CostSamples& samples, double count, double element_ns) noexcept;
/// Zero before the first sample. Where only one count was ever seen, more is taken to cost in proportion and less to cost
/// the same.
double predict_ns(const query::CostSamples& samples, double count) noexcept;
/// With as much more as the last samples lay above their line, and a quarter of that.
double promised_ns(const query::CostSamples& samples, double count) noexcept;
/// What an element may cost, the mean if none was far above it.
double dearest_element_ns(const query::CostSamples& samples, double count) noexcept;
/// What one more costs, where there are so many; a quarter of the mean at least, for that of few samples is not known well. Zero before
/// the first.
double per_element_ns(const query::CostSamples& samples, double count) noexcept;

}  // namespace rtstdb::transaction
