#include "rtstdb/accel/build_scratch.hpp"

#include <algorithm>
#include <utility>

#include "shaders/shared/node.h"

namespace rtstdb::accel {
namespace {

constexpr std::uint32_t groups_of(std::uint32_t count, std::uint32_t group) {
  return (count + group - 1) / group;
}

}  // namespace

std::uint32_t wide_node_bound(std::uint32_t primitives, std::uint32_t max_leaf) noexcept {
  const std::uint64_t n = primitives;
  const std::uint64_t narrow = max_leaf < 7 ? n * (7 - max_leaf) / (7ull * (max_leaf + 1)) : 0;
  return static_cast<std::uint32_t>(n / 7 + narrow + 2);
}

Result<BuildScratch> BuildScratch::create(gpu::Device& device, std::uint32_t primitives,
                                          const std::string& name) {
  BuildScratch scratch;
  const std::size_t n = std::max(primitives, 2u);
  scratch.capacity_ = static_cast<std::uint32_t>(n);
  // The collapse keeps its offsets where the sort keeps its histograms.
  const std::size_t offsets = std::max(n, RadixSort::count_words(n));
  const std::pair<gpu::Buffer*, gpu::BufferOptions> wanted[] = {
      {&scratch.bounds_, {.name = name + " bounds", .size_bytes = 24 * n}},
      {&scratch.keys_, {.name = name + " keys", .size_bytes = 2 * 8 * n}},
      {&scratch.values_, {.name = name + " values", .size_bytes = 2 * 4 * n}},
      {&scratch.binary_, {.name = name + " binary", .size_bytes = 16 * n}},
      {&scratch.parents_, {.name = name + " parents", .size_bytes = 2 * 4 * n}},
      {&scratch.node_bounds_, {.name = name + " node bounds", .size_bytes = 24 * n}},
      {&scratch.arrivals_, {.name = name + " arrivals", .size_bytes = 4 * n}},
      {&scratch.queue_, {.name = name + " queue", .size_bytes = 2 * 8 * n}},
      {&scratch.offsets_, {.name = name + " offsets", .size_bytes = 4 * offsets}},
      {&scratch.state_, {.name = name + " state", .size_bytes = 4 * shared::state_words}},
      {&scratch.state_readback_,
       {.name = name + " state readback",
        .size_bytes = 4 * shared::state_words,
        .memory = gpu::Memory::readback}},
  };
  for (const auto& [buffer, options] : wanted) {
    auto made = device.create_buffer(options);
    if (!made) return made.error();
    *buffer = std::move(made).value();
  }
  return scratch;
}

std::array<const gpu::Buffer*, BuildScratch::binding_count> BuildScratch::bindings(
    const gpu::Buffer& node_pool) const noexcept {
  return {&bounds_,   &keys_,  &values_,  &binary_, &parents_, &node_bounds_,
          &arrivals_, &queue_, &offsets_, &state_,  &node_pool};
}

namespace {

enum PassIndex : std::size_t {
  scene_bounds_pass,
  morton_pass,
  scan_pass,
  hierarchy_pass,
  fit_pass,
  collapse_count_pass,
  collapse_emit_pass,
};

constexpr gpu::ShaderId pass_shaders[] = {
    gpu::ShaderId::scene_bounds,  gpu::ShaderId::morton, gpu::ShaderId::scan,
    gpu::ShaderId::hierarchy,     gpu::ShaderId::fit,    gpu::ShaderId::collapse_count,
    gpu::ShaderId::collapse_emit,
};

}  // namespace

Result<LargeBuild> LargeBuild::create(gpu::Device& device) {
  LargeBuild build;
  for (std::size_t i = 0; i < pass_count; ++i) {
    auto pipeline = device.create_pipeline(pass_shaders[i]);
    if (!pipeline) return pipeline.error();
    build.pipelines_[i] = std::move(pipeline).value();
  }
  auto sort = RadixSort::create(device);
  if (!sort) return sort.error();
  build.sort_ = std::move(sort).value();
  return build;
}

Result<LargeBuild::Bound> LargeBuild::bind(gpu::Device& device, const BuildScratch& scratch,
                                           const gpu::Buffer& nodes) const {
  const auto buffers = scratch.bindings(nodes);
  Bound bound;
  for (std::size_t i = 0; i < pass_count; ++i) {
    auto bindings = device.create_bindings(pipelines_[i], buffers);
    if (!bindings) return bindings.error();
    bound.passes[i] = std::move(bindings).value();
  }
  auto sort = scratch.bind_sort(device, sort_);
  if (!sort) return sort.error();
  bound.sort = std::move(sort).value();
  return bound;
}

void LargeBuild::record_warm_up(const Bound& bound, gpu::Recorder& recorder) const {
  for (std::size_t i = 0; i < pass_count; ++i)
    recorder.dispatch(pipelines_[i], bound.passes[i], shared::BuildArgs{}, 1);
  sort_.record_warm_up(bound.sort, recorder);
}

bool LargeBuild::run(std::uint32_t count, const Bound& bound, const BuildScratch& scratch, Submit& submit,
                     std::vector<std::uint32_t>& levels) const {
  const auto dispatch = [&](PassIndex pass, const shared::BuildArgs& args, std::uint32_t groups) {
    submit.recorder().dispatch(pipelines_[pass], bound.passes[pass], args, groups);
    submit.recorder().barrier();
  };
  shared::BuildArgs args{};
  args.count = count;
  args.half_size = scratch.half_size();
  const std::uint32_t groups = groups_of(count, 64);

  gpu::Recorder& recorder = submit.recorder();
  recorder.barrier();
  recorder.fill(scratch.state(), 4 * shared::state_center_min, 12, 0xFFFFFFFFu);
  recorder.fill(scratch.state(), 4 * shared::state_center_max, 12, 0);
  recorder.barrier();
  dispatch(scene_bounds_pass, args, groups);
  dispatch(morton_pass, args, groups);
  sort_.record(count, scratch.half_size(), bound.sort, recorder);
  if (count > 1) {
    dispatch(hierarchy_pass, args, groups);
    dispatch(fit_pass, args, groups);
  }
  // The first level is the root: binary node 0 becomes wide node 0.
  recorder.fill(scratch.queue(), 0, 8, 0);
  recorder.barrier();

  args.level_count = 1;
  levels.clear();
  while (true) {
    args.scan_count = args.level_count;
    if (count > 1) {
      dispatch(collapse_count_pass, args, groups_of(args.level_count, 64));
      dispatch(scan_pass, args, 1);
    }
    dispatch(collapse_emit_pass, args, groups_of(args.level_count, 64));
    recorder.copy(scratch.state(), 0, scratch.state_readback(), 0, 4 * shared::state_words);
    if (!submit.run()) return false;
    levels.push_back(args.level_first);
    args.level_first += args.level_count;
    args.level_count =
        count > 1 ? scratch.state_readback().host_as<std::uint32_t>()[shared::state_level_count] : 0;
    if (args.level_count == 0) break;
    args.queue_half = 1 - args.queue_half;
    submit.begin();
  }
  levels.push_back(args.level_first);
  return true;
}

}  // namespace rtstdb::accel
