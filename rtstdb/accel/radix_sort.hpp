#pragma once
// Sorts 63-bit codes with the numbers 0, 1, ... on the device, stable: shaders/build/sort.glsl tells how.
//
// Threads: one. create and bind are setup; record allocates nothing.

#include <array>

#include "rtstdb/gpu/device.hpp"

namespace rtstdb::accel {

class RadixSort {
 public:
  static Result<RadixSort> create(gpu::Device& device);

  /// Words of the counts' buffer for sorts of at most so many keys.
  static std::size_t count_words(std::size_t capacity) noexcept;

  static constexpr std::size_t pass_count = 5;
  using Bound = std::array<gpu::Bindings, pass_count>;
  /// `keys`: four parts of uint as sort.glsl says, `values`: uint in two halves, all parts of equal size.
  Result<Bound> bind(gpu::Device& device, const gpu::Buffer& keys, const gpu::Buffer& values,
                     const gpu::Buffer& counts) const;

  void record_warm_up(const Bound& bound, gpu::Recorder& recorder) const;
  enum class Words {
    upper,  ///< rows of more than a few codes with the same upper word stay as they are
    both,   ///< twice the work
  };
  /// Sorts the values in the first half; the upper words stand beside them afterwards.
  void record(std::uint32_t count, std::uint32_t half_size, Words words, const Bound& bound,
              gpu::Recorder& recorder) const;
  /// The same in steps, one after the other, a dispatch each.
  static constexpr std::uint32_t steps(Words words) noexcept {
    return words == Words::upper ? word_steps + 1 : 2 * (1 + word_steps);
  }
  void record_step(std::uint32_t step, std::uint32_t count, std::uint32_t half_size, Words words,
                   const Bound& bound, gpu::Recorder& recorder) const;

 private:
  static constexpr std::uint32_t digit_steps = 3;
  static constexpr std::uint32_t word_steps = 4 * digit_steps;
  std::array<gpu::Pipeline, pass_count> pipelines_;
};

}  // namespace rtstdb::accel
