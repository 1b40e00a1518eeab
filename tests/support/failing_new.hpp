#pragma once
// Operator new that throws on threads of one name, in the whole test program, when it is told to.

namespace hil::test {

/// After so many more allocations by operator new.
void fail_allocations_of(const char* thread_name, int after);
void stop_failing_allocations();
/// Whether any has failed since it was told to.
bool allocations_failed();

}  // namespace hil::test
