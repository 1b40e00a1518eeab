// Suppresses leaks of others under the address sanitizer: of lavapipe (128 bytes for each device in Mesa
// 22.3) and of the validation layer (6,840 bytes for some pipelines in 1.3.239; it reports by itself what we
// do not destroy). The driver stays loaded to the end, since the sanitizer knows the library of a
// leak only while it is loaded.

#include <dlfcn.h>

// The name is the sanitizer's.
// NOLINTNEXTLINE(bugprone-reserved-identifier,readability-identifier-naming)
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libvulkan_lvp.so\nleak:libLLVM\nleak:libVkLayer_khronos_validation.so\n";
}

namespace {

// Null on a machine without lavapipe.
[[maybe_unused]] const void* const kept_driver =
    dlopen("libvulkan_lvp.so", RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);

}  // namespace
