// Linked into programs that open a device under the address sanitizer: the leaks of lavapipe itself (128
// bytes a device in Mesa 22.3) are not ours to mend. The driver stays loaded to the end, since the sanitizer
// knows a leak's library only while it is there.

#include <dlfcn.h>

// The name is the sanitizer's.
// NOLINTNEXTLINE(bugprone-reserved-identifier,readability-identifier-naming)
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libvulkan_lvp.so\nleak:libLLVM\n";
}

namespace {

// Null on a machine without lavapipe, where there is nothing to keep.
[[maybe_unused]] const void* const kept_driver =
    dlopen("libvulkan_lvp.so", RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);

}  // namespace
