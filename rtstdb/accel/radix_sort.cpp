#include "rtstdb/accel/radix_sort.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "rtstdb/accel/tree_levels.hpp"
#include "shaders/shared/build.h"

namespace rtstdb::accel {
namespace {

enum PassIndex : std::size_t { count_pass, scan_pass, place_pass };

constexpr gpu::ShaderId pass_shaders[] = {gpu::ShaderId::sort_count, gpu::ShaderId::sort_scan,
                                          gpu::ShaderId::sort_place};

constexpr std::uint32_t shortest_run = 64;
constexpr std::uint32_t longest_run = 1024;
constexpr std::uint32_t most_small_runs = 512;

/// Keys that one invocation takes: a few hundred invocations, as long as each has not too many.
std::uint32_t run_length(std::uint32_t count) noexcept {
  return std::clamp(std::bit_ceil(count / most_small_runs + 1), shortest_run, longest_run);
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

std::size_t RadixSort::count_words(std::size_t capacity) noexcept {
  // Fewer keys than there is room for may make more runs.
  const std::size_t runs = std::max<std::size_t>(most_small_runs, capacity / longest_run + 1);
  return shared::radix_digits * (runs + 1);
}

Result<RadixSort::Bound> RadixSort::bind(gpu::Device& device, const gpu::Buffer& keys,
                                         const gpu::Buffer& values, const gpu::Buffer& counts) const {
  const gpu::Buffer* buffers[] = {&keys, &values, &counts};
  Bound bound;
  for (std::size_t i = 0; i < pass_count; ++i) {
    auto bindings = device.create_bindings(pipelines_[i], buffers);
    if (!bindings) return bindings.error();
    bound[i] = std::move(bindings).value();
  }
  return bound;
}

void RadixSort::record_warm_up(const Bound& bound, gpu::Recorder& recorder) const {
  shared::SortArgs nothing{};
  nothing.run = shortest_run;
  for (std::size_t i = 0; i < pass_count; ++i)
    recorder.dispatch(pipelines_[i], bound[i], nothing, 1);
}

void RadixSort::record(std::uint32_t count, std::uint32_t half_size, const Bound& bound,
                       gpu::Recorder& recorder) const {
  shared::SortArgs args{
      .count = count, .half_size = half_size, .shift = 0, .source = 0, .run = run_length(count)};
  const auto dispatch = [&](PassIndex pass, std::uint32_t groups) {
    recorder.dispatch(pipelines_[pass], bound[pass], args, groups);
    recorder.barrier();
  };
  const std::uint32_t groups = groups_of(groups_of(count, args.run), 32);
  // Eight digits of eight bits cover the 63-bit code; an even number of passes ends where it began.
  for (; args.shift < 64; args.shift += shared::radix_bits) {
    dispatch(count_pass, groups);
    dispatch(scan_pass, 1);
    dispatch(place_pass, groups);
    args.source = 1 - args.source;
  }
}

}  // namespace rtstdb::accel
