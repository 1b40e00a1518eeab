#pragma once
// How the state of the tree builders stores the levels of a tree (shaders/shared/blas.h), and how passes are
// divided into workgroups.

#include <cstddef>
#include <cstdint>

#include "shaders/shared/blas.h"

namespace rtstdb::accel {

constexpr std::uint32_t groups_of(std::uint32_t count, std::uint32_t group) {
  return (count + group - 1) / group;
}

/// Index into the state of a word of a level's record.
constexpr std::size_t level_word(std::uint32_t level, std::uint32_t word) {
  return shared::blas_levels + std::size_t{level} * shared::blas_level_words + word;
}

}  // namespace rtstdb::accel
