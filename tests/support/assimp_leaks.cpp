// Read by the leak sanitizer where it is on: assimp's own readers leak when they give up on a broken file.
// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming)
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libassimp";
}
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)
