#pragma once
// Makes operator new fail in threads of one name.

namespace hil::tests {

/// After that many further allocations by operator new in these threads.
void fail_allocations_of(const char* thread_name, int after);
void stop_failing_allocations();
/// Whether an allocation has failed since fail_allocations_of().
bool allocations_failed();

}  // namespace hil::tests
