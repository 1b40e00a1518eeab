#include "rtstdb/accel/blas_builder.hpp"

#include <algorithm>
#include <bit>

#include "rtstdb/accel/tree_levels.hpp"
#include "shaders/shared/node.h"

namespace rtstdb::accel {
namespace {

/// Scratch memory for more triangles is freed after the build, unless deforming geometry needs it.
constexpr std::size_t kept_capacity = 1u << 17;
constexpr std::size_t node_bytes = 16 * shared::node_texels;
constexpr std::size_t triangle_bytes = 16 * shared::triangle_texels;

constexpr gpu::ShaderId pass_shaders[] = {
    gpu::ShaderId::blas_centers, gpu::ShaderId::blas_codes, gpu::ShaderId::blas_leaves,
    gpu::ShaderId::blas_merge,   gpu::ShaderId::blas_root,  gpu::ShaderId::blas_count,
    gpu::ShaderId::blas_queue,   gpu::ShaderId::blas_nodes, gpu::ShaderId::blas_triangles,
    gpu::ShaderId::blas_order,
};

const Error lost{ErrorCode::device_lost, "the GPU stopped answering while a geometry was built"};

}  // namespace

Result<BlasBuilder> BlasBuilder::create(gpu::Device& device, Submit& submit) {
  BlasBuilder builder;
  builder.levels_.reserve(max_levels);
  for (std::size_t i = 0; i < pass_count; ++i) {
    auto pipeline = device.create_pipeline(pass_shaders[i]);
    if (!pipeline) return pipeline.error();
    builder.passes_[i].pipeline = std::move(pipeline).value();
  }
  auto sort = RadixSort::create(device);
  if (!sort) return sort.error();
  builder.sort_ = std::move(sort).value();
  if (device.compiles_on_first_dispatch()) return builder;
  TriangleMesh some;
  some.positions_m = {{0.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}};
  some.triangles.assign(16, {0, 1, 2});
  if (auto built = builder.build(device, some, submit); !built) return built.error();
  const auto make_pool = [&](std::size_t size_bytes) {
    return device.create_buffer({.name = "warm-up pool", .size_bytes = size_bytes, .addressed = true});
  };
  const auto nodes = make_pool(node_bytes * builder.node_count_);
  if (!nodes) return nodes.error();
  const auto triangles = make_pool(triangle_bytes * some.triangles.size());
  if (!triangles) return triangles.error();
  if (!builder.write({}, nodes.value(), triangles.value(), submit)) return lost;
  const auto order = make_pool(16 * some.triangles.size());
  if (!order) return order.error();
  if (!builder.write_order(order.value(), submit)) return lost;
  return builder;
}

Result<void> BlasBuilder::adopt(gpu::Device& device, BlasScratch scratch) {
  // The bindings refer to the old buffers.
  for (Pass& pass : passes_)
    pass.bindings = {};
  sort_bound_ = {};
  scratch_ = std::move(scratch);
  const auto buffers = scratch_.bindings();
  auto sort_bound = scratch_.bind_sort(device, sort_);
  if (!sort_bound) {
    scratch_ = {};
    return sort_bound.error();
  }
  sort_bound_ = std::move(sort_bound).value();
  for (Pass& pass : passes_) {
    auto bindings = device.create_bindings(pass.pipeline, buffers);
    if (!bindings) {
      scratch_ = {};
      return bindings.error();
    }
    pass.bindings = std::move(bindings).value();
  }
  return {};
}

Result<void> BlasBuilder::reserve(gpu::Device& device, std::size_t triangles, std::size_t positions) {
  if (has_capacity_for(triangles, positions)) return {};
  const auto roomy = [](std::size_t n) { return n <= kept_capacity ? std::bit_ceil(n) : n; };
  const std::size_t most = std::max<std::size_t>(triangles, scratch_.capacity());
  auto scratch = BlasScratch::create(device, static_cast<std::uint32_t>(roomy(most)),
                                     roomy(std::max(positions, scratch_.positions_capacity())));
  if (!scratch) return scratch.error();
  return adopt(device, std::move(scratch).value());
}

void BlasBuilder::release(gpu::Device& device) {
  if (scratch_.capacity() <= std::max(kept_capacity, kept_triangles_) &&
      scratch_.positions_capacity() <= std::max(kept_capacity, kept_positions_))
    return;
  for (Pass& pass : passes_)
    pass.bindings = {};
  sort_bound_ = {};
  scratch_ = {};
  if (kept_triangles_ > 0 && !reserve(device, kept_triangles_, kept_positions_)) scratch_ = {};
}

void BlasBuilder::dispatch(PassIndex pass, const shared::BlasArgs& args, std::uint32_t groups,
                           Submit& submit) const {
  submit.recorder().dispatch(passes_[pass].pipeline, passes_[pass].bindings, args, groups);
  submit.recorder().barrier();
}

shared::BlasArgs BlasBuilder::args_of_build() const noexcept {
  shared::BlasArgs args{};
  args.count = count_;
  return args;
}

void BlasBuilder::record_tree(RadixSort::Words words, Submit& submit) const {
  shared::BlasArgs args = args_of_build();
  args.target = scratch_.tree().address();
  gpu::Recorder& recorder = submit.recorder();
  recorder.fill(scratch_.state(), 0, 4 * shared::blas_state_words, 0);
  recorder.barrier();
  const std::uint32_t tiles = groups_of(count_, shared::blas_tile);
  dispatch(centers_pass, args, tiles, submit);
  dispatch(codes_pass, args, tiles, submit);
  sort_.record(count_, scratch_.capacity(), words, sort_bound_, recorder);
  dispatch(leaves_pass, args, tiles, submit);
  dispatch(merge_pass, args, groups_of(count_, 64 * shared::blas_run), submit);
  dispatch(root_pass, args, 1, submit);
}

void BlasBuilder::record_levels(Submit& submit) const {
  gpu::Recorder& recorder = submit.recorder();
  shared::BlasArgs args = args_of_build();
  for (args.level = 0; args.level < shared::blas_levels_recorded; ++args.level) {
    const std::size_t groups = 4 * level_word(args.level, shared::blas_level_groups);
    for (const PassIndex pass : {count_pass, queue_pass}) {
      recorder.dispatch_indirect(passes_[pass].pipeline, passes_[pass].bindings, args, scratch_.state(),
                                 groups);
      recorder.barrier();
    }
  }
  recorder.copy(scratch_.state(), 0, scratch_.state_readback(), 0, 4 * shared::blas_state_words);
}

/// Appends the levels of the last submission. True: the tree is complete.
bool BlasBuilder::append_levels(std::span<const std::uint32_t> state) {
  // The record behind the last level holds the number of nodes.
  constexpr std::uint32_t last = shared::blas_levels_recorded;
  node_count_ = 0;
  for (std::uint32_t level = 0; level <= last; ++level) {
    const std::uint32_t first = state[level_word(level, shared::blas_level_first)];
    const std::uint32_t count = state[level_word(level, shared::blas_level_count)];
    node_count_ = std::max(node_count_, first + count);
    if (level < last && count != 0) levels_.push_back(first);
  }
  const bool whole = state[level_word(last, shared::blas_level_count)] == 0;
  if (whole) levels_.push_back(node_count_);
  return whole;
}

/// Copies the record behind the last recorded level, at which the next submission continues.
void BlasBuilder::record_continuation(gpu::Recorder& recorder) const {
  constexpr std::uint32_t last = shared::blas_levels_recorded;
  recorder.fill(scratch_.state(), 4 * shared::blas_levels,
                4 * (shared::blas_state_words - shared::blas_levels), 0);
  recorder.barrier();
  recorder.copy(scratch_.state_readback(), 4 * level_word(last, 0), scratch_.state(), 4 * level_word(0, 0),
                4 * shared::blas_level_words);
  recorder.barrier();
}

Result<void> BlasBuilder::start_build(gpu::Device& device, const MeshView& mesh, Submit& submit) {
  if (auto reserved = reserve(device, mesh.triangles.size(), mesh.positions_m.size()); !reserved)
    return reserved.error();
  scratch_.upload(mesh);
  levels_.clear();
  count_ = static_cast<std::uint32_t>(mesh.triangles.size());
  submit.begin();
  record_tree(RadixSort::Words::upper, submit);
  record_levels(submit);
  if (!submit.start()) return lost;
  return {};
}

Result<std::uint32_t> BlasBuilder::finish_build(Submit& submit) {
  while (true) {
    if (!submit.finish()) return lost;
    const auto state = scratch_.state_readback().host_as<std::uint32_t>();
    const bool sorted = state[shared::blas_disorder] == 0;
    if (sorted && append_levels(state)) return node_count_;
    submit.begin();
    if (sorted)
      record_continuation(submit.recorder());
    else
      record_tree(RadixSort::Words::both, submit);
    record_levels(submit);
    if (!submit.start()) return lost;
  }
}

Result<std::uint32_t> BlasBuilder::build(gpu::Device& device, const MeshView& mesh, Submit& submit) {
  if (auto started = start_build(device, mesh, submit); !started) return started.error();
  return finish_build(submit);
}

bool BlasBuilder::write(const Place& place, const gpu::Buffer& nodes, const gpu::Buffer& triangles,
                        Submit& submit) {
  shared::BlasArgs args = args_of_build();
  args.leaf_base = place.leaf_base;
  args.node_base = place.node_base;
  args.node_count = node_count_;
  submit.begin();
  args.target = nodes.address(place.node_base * node_bytes);
  dispatch(nodes_pass, args, groups_of(node_count_, 64), submit);
  args.target = triangles.address(place.leaf_base * triangle_bytes);
  dispatch(triangles_pass, args, groups_of(count_, shared::blas_tile), submit);
  return submit.run();
}

bool BlasBuilder::write_order(const gpu::Buffer& order, Submit& submit) {
  shared::BlasArgs args = args_of_build();
  args.target = order.address();
  submit.begin();
  dispatch(order_pass, args, groups_of(count_, shared::blas_tile), submit);
  return submit.run();
}

}  // namespace rtstdb::accel
