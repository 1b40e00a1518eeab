#pragma once
// Sorts 63-bit codes with the numbers 0, 1, ... on the device, stable: shaders/build/sort.glsl tells how.
//
// Threads: one. create and bind are setup; record allocates nothing.

#include <array>
#include <string>

#include "rtstdb/gpu/device.hpp"

namespace rtstdb::accel {

class RadixSort {
 public:
  static Result<RadixSort> create(gpu::Device& device);

  static constexpr std::size_t pass_count = 5;
  struct Bound {
    std::array<gpu::Bindings, pass_count> passes;
    glm::uvec2 sorted{0, 0}, counts{0, 0};  ///< addresses
  };
  /// The buffers as sort.glsl says.
  Result<Bound> bind(gpu::Device& device, const gpu::Buffer& sorted, const gpu::Buffer& words,
                     const gpu::Buffer& counts) const;
  /// Room for `capacity` keys with their values, twice; an even number of them.
  static gpu::BufferOptions sorted_buffer(std::string name, std::size_t capacity);
  /// For sorts of at most so many keys; holds as many words at the least.
  static gpu::BufferOptions counts_buffer(std::string name, std::size_t capacity);

  void record_warm_up(const Bound& bound, gpu::Recorder& recorder) const;
  enum class Words {
    upper,  ///< rows of more than a few codes with the same upper word stay as they are
    both,   ///< twice the work
  };
  /// Sorts the first half.
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
