// The order in which the memory types of different devices are tried for a buffer.

#include "rtstdb/gpu/memory_choice.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace rtstdb::gpu {
namespace {

using Ranked = std::vector<std::uint32_t>;
constexpr std::uint32_t all_types = ~0u;

constexpr MemoryTraits local{.device_local = true};
constexpr MemoryTraits host{.host_visible = true, .host_coherent = true};
constexpr MemoryTraits host_cached{.host_visible = true, .host_coherent = true, .host_cached = true};
constexpr MemoryTraits mapped_local{.device_local = true, .host_visible = true, .host_coherent = true};
constexpr MemoryTraits unified{
    .device_local = true, .host_visible = true, .host_coherent = true, .host_cached = true};

TEST(MemoryChoice, UsesTheOneTypeOfLavapipe) {
  const std::vector<MemoryTraits> lavapipe{unified};
  for (const Memory memory : {Memory::device, Memory::upload, Memory::readback}) {
    EXPECT_EQ(rank_memory_types(lavapipe, all_types, memory), Ranked{0});
  }
}

TEST(MemoryChoice, UsesTheMappedMemoryOfADiscreteGpuForUploads) {
  const std::vector<MemoryTraits> discrete{MemoryTraits{}, local, host, host_cached, mapped_local};
  EXPECT_EQ(rank_memory_types(discrete, all_types, Memory::device), (Ranked{1, 4, 0, 2, 3}));
  EXPECT_EQ(rank_memory_types(discrete, all_types, Memory::upload), (Ranked{4, 2, 3}));
  EXPECT_EQ(rank_memory_types(discrete, all_types, Memory::readback), (Ranked{3, 2, 4}));
}

TEST(MemoryChoice, ReadsBackThroughTheCacheOfAnIntegratedGpu) {
  const std::vector<MemoryTraits> integrated{local, mapped_local, unified};
  EXPECT_EQ(rank_memory_types(integrated, all_types, Memory::device).front(), 0u);
  EXPECT_EQ(rank_memory_types(integrated, all_types, Memory::upload).front(), 1u);
  EXPECT_EQ(rank_memory_types(integrated, all_types, Memory::readback).front(), 2u);
}

TEST(MemoryChoice, UsesAllowedTypesOnly) {
  const std::vector<MemoryTraits> discrete{local, host, host_cached, mapped_local};
  EXPECT_EQ(rank_memory_types(discrete, 0b0110, Memory::device), (Ranked{1, 2}));
  EXPECT_EQ(rank_memory_types(discrete, 0b0001, Memory::upload), Ranked{});
  EXPECT_EQ(rank_memory_types(discrete, 0, Memory::device), Ranked{});
}

TEST(MemoryChoice, UsesCoherentAndNoSpecialMemory) {
  constexpr MemoryTraits incoherent{.host_visible = true, .host_cached = true};
  constexpr MemoryTraits guarded{
      .device_local = true, .host_visible = true, .host_coherent = true, .special = true};
  const std::vector<MemoryTraits> types{guarded, incoherent, host};
  EXPECT_EQ(rank_memory_types(types, all_types, Memory::upload), Ranked{2});
  EXPECT_EQ(rank_memory_types(types, all_types, Memory::readback), Ranked{2});
  EXPECT_EQ(rank_memory_types({types.data(), 1}, all_types, Memory::device), Ranked{});
}

}  // namespace
}  // namespace rtstdb::gpu
