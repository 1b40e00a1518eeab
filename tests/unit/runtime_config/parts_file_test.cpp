#include "runtime/config/parts_file.hpp"

#include "scenario_fixture.hpp"

namespace hil::config {
namespace {

using tests::TemporaryFolder;

constexpr std::uint64_t many = 1'000'000;

std::string mistakes_of_parts(const std::string& text, std::uint64_t max_triangles = many) {
  const TemporaryFolder folder;
  Diagnostics diagnostics;
  EXPECT_FALSE(load_parts(folder.write("parts.yaml", text), max_triangles, diagnostics)) << text;
  return diagnostics.to_text();
}

TEST(PartsFile, IsReadAsWritten) {
  const TemporaryFolder folder;
  Diagnostics diagnostics;
  const auto parts = load_parts(folder.write("parts.yaml", R"(
parts:
  - box: [1 m, 2 m, 3 m]
  - cylinder: {radius: 20 cm, height: 1 m, segments: 8}
    position: [1 m, 0 m, -1 m]
    rotation: {yaw: 180 deg}
    repeat:
      - {count: 3, step: [0 m, 1 m, 0 m]}
      - {count: 5, turn: 90 deg, axis: x}
  - cone: {radius: 1 m, height: 2 m}
  - cone: {radius: 1 m, top_radius: 50 cm, height: 2 m}
  - sphere: 1 m
    color: '#ff0000'
  - ring: {radius: 1 m, tube_radius: 10 cm, segments: 12, sides: 6}
)"),
                                many, diagnostics);
  ASSERT_TRUE(parts) << diagnostics.to_text();
  ASSERT_EQ(parts->size(), 6U);
  EXPECT_EQ(std::get<BoxPart>((*parts)[0].body).size_m, (std::array<double, 3>{1.0, 2.0, 3.0}));
  const Part& cylinder = (*parts)[1];
  EXPECT_EQ(std::get<ConePart>(cylinder.body).top_radius_m, 0.2);
  EXPECT_EQ(cylinder.position_m, (std::array<double, 3>{1.0, 0.0, -1.0}));
  EXPECT_NEAR(cylinder.rotation_wxyz[3], 1.0, 1e-15);
  ASSERT_EQ(cylinder.repeat.size(), 2U);
  EXPECT_EQ(cylinder.repeat[0].count, 3U);
  EXPECT_EQ(cylinder.repeat[0].step_m[1], 1.0);
  EXPECT_EQ(cylinder.repeat[1].axis, 0U);
  EXPECT_NEAR(cylinder.repeat[1].turn_rad, 1.5707963, 1e-6);
  EXPECT_EQ((*parts)[3].color, (std::array<double, 3>{1.0, 1.0, 1.0}));
  EXPECT_EQ((*parts)[4].color, (std::array<double, 3>{1.0, 0.0, 0.0}));
  std::vector<std::uint64_t> triangles;
  for (const Part& part : *parts)
    triangles.push_back(triangles_of(part));
  EXPECT_EQ(triangles, (std::vector<std::uint64_t>{12, 32 * 15, 64, 128, 1280, 144}));
}

TEST(PartsFile, MistakesHaveTheirPlaces) {
  EXPECT_NE(
      mistakes_of_parts("parts:\n  - ring: {radius: 1 m, tube_radius: 1 m}\n").find("parts.yaml:2:38: "),
      std::string::npos);
  EXPECT_NE(mistakes_of_parts("parts:\n  - box: [1 m, 2 m, 3 m]\n    repeat: [{count: 0}]\n").find("count"),
            std::string::npos);
  EXPECT_NE(mistakes_of_parts("parts:\n  - cuboid: [1 m, 2 m, 3 m]\n").find("cuboid"), std::string::npos);
  EXPECT_NE(mistakes_of_parts("parts: []\n").find("parts"), std::string::npos);
}

TEST(PartsFile, TooManyTrianglesAreRefusedAtTheFirstPartBeyondThem) {
  const std::string text =
      "parts:\n  - box: [1 m, 1 m, 1 m]\n  - box: [1 m, 1 m, 1 m]\n    repeat: [{count: 9}]\n  - sphere: 1 "
      "m\n";
  EXPECT_NE(mistakes_of_parts(text, 100).find(
                "parts.yaml:3:5: 120 triangles up to this part; at most 100 are possible"),
            std::string::npos)
      << mistakes_of_parts(text, 100);
  // Counts whose product is beyond 64 bits: the number is a lower bound.
  const std::string beyond = mistakes_of_parts(
      "parts:\n  - box: [1 m, 1 m, 1 m]\n    repeat: [{count: 1000000}, {count: 1000000}, {count: 1000000}, "
      "{count: 1000000}]\n");
  EXPECT_NE(beyond.find("parts.yaml:2:5: at least 1099511627776 triangles up to this part; at most "),
            std::string::npos)
      << beyond;
}

}  // namespace
}  // namespace hil::config
