#include "rtstdb/accel/radix_sort.hpp"

#include <algorithm>
#include <utility>

#include "rtstdb/accel/tree_levels.hpp"
#include "shaders/shared/build.h"

namespace rtstdb::accel {
namespace {

enum PassIndex : std::size_t { count_pass, scan_pass, place_pass, ties_pass, keys_pass };

constexpr gpu::ShaderId pass_shaders[] = {gpu::ShaderId::sort_count, gpu::ShaderId::sort_scan,
                                          gpu::ShaderId::sort_place, gpu::ShaderId::sort_ties,
                                          gpu::ShaderId::sort_keys};

constexpr std::uint32_t runs_per_group = 32;
constexpr std::uint32_t shortest_run = 128;
constexpr std::uint32_t longest_run = 1024;
constexpr std::uint32_t max_groups_of_short_runs = 8;
constexpr std::uint32_t keys_per_group = 1024;  // for passes that process each key by itself

/// Number of keys per invocation, even. Small enough to give an even number of workgroups, which software
/// devices distribute evenly, and large enough to amortize the counts.
std::uint32_t run_length(std::uint32_t count) noexcept {
  const std::uint32_t groups =
      std::clamp(2 * (count / (2 * runs_per_group * shortest_run)), 2u, max_groups_of_short_runs);
  const std::uint32_t run = std::min(groups_of(count, groups * runs_per_group), longest_run);
  return std::max(2 * groups_of(run, 2), 2u);
}

gpu::BufferOptions stored_by_address(std::string name, std::size_t texels) {
  return {.name = std::move(name),
          .size_bytes = 16 * texels,
          .texel_uint4 = true,
          .texel_image = true,
          .addressed = true};
}

}  // namespace

Result<RadixSort> RadixSort::create(gpu::Device& device) {
  RadixSort sort;
  for (std::size_t i = 0; i < pass_count; ++i) {
    auto pipeline = device.create_pipeline(pass_shaders[i]);
    if (!pipeline) return pipeline.error();
    sort.pipelines_[i] = std::move(pipeline).value();
  }
  return sort;
}

gpu::BufferOptions RadixSort::sorted_buffer(std::string name, std::size_t capacity) {
  RTSTDB_ASSERT(capacity % 2 == 0, "the capacity is odd");
  return stored_by_address(std::move(name), capacity);
}

gpu::BufferOptions RadixSort::counts_buffer(std::string name, std::size_t capacity) {
  // A sort of fewer keys than the capacity may have more runs.
  constexpr std::size_t max_short_runs = runs_per_group * max_groups_of_short_runs;
  const std::size_t rows = std::max(max_short_runs, capacity / longest_run + 1) + 1;
  return stored_by_address(std::move(name), std::max(rows * shared::radix_digits / 4, (capacity + 3) / 4));
}

Result<RadixSort::Bound> RadixSort::bind(gpu::Device& device, const gpu::Buffer& sorted,
                                         const gpu::Buffer& words, const gpu::Buffer& counts) const {
  const gpu::Buffer* buffers[] = {&sorted, &words, &counts};
  Bound bound;
  bound.sorted = sorted.address();
  bound.counts = counts.address();
  for (std::size_t i = 0; i < pass_count; ++i) {
    auto bindings = device.create_bindings(pipelines_[i], buffers);
    if (!bindings) return bindings.error();
    bound.passes[i] = std::move(bindings).value();
  }
  return bound;
}

void RadixSort::record_warm_up(const Bound& bound, gpu::Recorder& recorder) const {
  shared::SortArgs nothing{};
  nothing.run = 2;
  nothing.sorted = bound.sorted;
  nothing.counts = bound.counts;
  for (std::size_t i = 0; i < pass_count; ++i)
    recorder.dispatch(pipelines_[i], bound.passes[i], nothing, 1);
}

void RadixSort::record(std::uint32_t count, std::uint32_t half_size, Words words, const Bound& bound,
                       gpu::Recorder& recorder) const {
  for (std::uint32_t step = 0; step < steps(words); ++step)
    record_step(step, count, half_size, words, bound, recorder);
}

void RadixSort::record_step(std::uint32_t step, std::uint32_t count, std::uint32_t half_size, Words words,
                            const Bound& bound, gpu::Recorder& recorder) const {
  shared::SortArgs args{};
  args.count = count;
  args.half_size = half_size;
  args.sorted = bound.sorted;
  args.counts = bound.counts;
  const auto dispatch = [&](PassIndex pass, std::uint32_t groups) {
    recorder.dispatch(pipelines_[pass], bound.passes[pass], args, groups);
    recorder.barrier();
  };
  const auto visit_each = [&](PassIndex pass) {
    args.run = keys_per_group;
    dispatch(pass, groups_of(count, keys_per_group));
  };
  // When sorting by both words, each word begins with loading its keys; by the upper word alone, ties come
  // last.
  const std::uint32_t steps_before = words == Words::both ? 1 : 0;
  const std::uint32_t word = step / (steps_before + word_steps);
  const std::uint32_t of_word = step % (steps_before + word_steps);
  if (words == Words::both && of_word == 0) {
    args.shift = word;
    return visit_each(keys_pass);
  }
  if (words == Words::upper && word == 1) return visit_each(ties_pass);
  // Four digits of eight bits: an even number of passes leaves the result in the first half.
  const std::uint32_t digit = (of_word - steps_before) / digit_steps;
  args.shift = digit * shared::radix_bits;
  args.source = digit % 2;
  args.run = run_length(count);
  const std::uint32_t groups = groups_of(groups_of(count, args.run), runs_per_group);
  constexpr PassIndex passes[] = {count_pass, scan_pass, place_pass};
  const PassIndex pass = passes[(of_word - steps_before) % digit_steps];
  dispatch(pass, pass == scan_pass ? 1 : groups);
}

}  // namespace rtstdb::accel
