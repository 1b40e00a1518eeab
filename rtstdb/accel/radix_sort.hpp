#pragma once
// A stable radix sort on the device of 63-bit codes together with the numbers 0, 1, ...; see
// shaders/build/sort.glsl.
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
    glm::uvec2 sorted{0, 0}, counts{0, 0};  ///< device addresses
  };
  /// Binds the buffers that sort.glsl describes.
  Result<Bound> bind(gpu::Device& device, const gpu::Buffer& sorted, const gpu::Buffer& words,
                     const gpu::Buffer& counts) const;
  /// Holds `capacity` (even) keys with their values, twice.
  static gpu::BufferOptions sorted_buffer(std::string name, std::size_t capacity);
  /// For sorts of at most `capacity` keys; holds at least `capacity` words.
  static gpu::BufferOptions counts_buffer(std::string name, std::size_t capacity);

  void record_warm_up(const Bound& bound, gpu::Recorder& recorder) const;
  enum class Words {
    upper,  ///< runs of more than a few codes with equal upper words stay unsorted
    both,   ///< sorts by all bits, at twice the work
  };
  /// Sorts the first half.
  void record(std::uint32_t count, std::uint32_t half_size, Words words, const Bound& bound,
              gpu::Recorder& recorder) const;
  /// The same in steps of one dispatch each, to be recorded in order.
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
