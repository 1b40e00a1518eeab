// The compiler must not treat the conversion of doubles to float and back as the identity: low parts of poses
// would be zero (cmake/compile_options.cmake).

#include <glm/ext/vector_double3.hpp>
#include <glm/vec3.hpp>
#include <gtest/gtest.h>

namespace rtstdb {
namespace {

[[gnu::noinline]] glm::vec3 remainder_of(const glm::dvec3& value) {
  return glm::vec3(value - glm::dvec3(glm::vec3(value)));
}

TEST(Compiler, KeepsTheRoundingOfVectors) {
  const glm::dvec3 third(1.0 / 3.0, 2.0 / 3.0, 4.0 / 3.0);
  for (int i = 0; i < 3; ++i)
    EXPECT_NE(remainder_of(third)[i], 0.0f);
}

}  // namespace
}  // namespace rtstdb
