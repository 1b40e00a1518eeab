#pragma once
// Counts the heap allocations of the whole process while armed. Under a sanitizer, whose malloc is its own,
// only operator new is seen.

#include <cstdint>

namespace rtstdb::transaction::test {

void arm_allocation_count();
/// Disarms; allocations by any thread since armed.
std::uint64_t allocations_since_armed();

}  // namespace rtstdb::transaction::test
