// The reader of SPIR-V and the comparison of kernels with their table.

#include "rtstdb/gpu/shader_reflection.hpp"

#include <gtest/gtest.h>

#include <random>

#include "rtstdb/gpu/timestamp.hpp"
#include "tests/gpu/gpu_fixture.hpp"

namespace rtstdb::gpu::test {
namespace {

std::string difference(const ShaderInfo& table) {
  const auto code = reflect_shader(table.spirv);
  if (!code) return "not readable";
  return find_difference(table, *code).value_or("");
}

void expect_difference(const ShaderInfo& table, const std::string& of_table, const std::string& of_code) {
  const std::string text = difference(table);
  EXPECT_NE(text.find(std::string(table.name)), std::string::npos) << text;
  EXPECT_NE(text.find("the table says " + of_table), std::string::npos) << text;
  EXPECT_NE(text.find("the code says " + of_code), std::string::npos) << text;
}

TEST(ShaderReflection, FindsNoDifferenceInTheKernelsOfTheProduct) {
  for (std::uint16_t i = 0; i < static_cast<std::uint16_t>(ShaderId::count); ++i) {
    const ShaderInfo& info = shader_info(static_cast<ShaderId>(i));
    EXPECT_EQ(difference(info), "") << info.name;
  }
}

TEST(ShaderReflection, ReadsGroupSizeBindingsAndPushConstants) {
  const auto code = reflect_shader(test_shader_info(TestShader::read_texels).spirv);
  ASSERT_TRUE(code.has_value());
  EXPECT_EQ(code->group_size, (std::array<std::uint32_t, 3>{64, 1, 1}));
  ASSERT_EQ(code->bindings.size(), 3u);
  for (std::uint32_t i = 0; i < 3; ++i) {
    EXPECT_EQ(code->bindings[i].set, 0u);
    EXPECT_EQ(code->bindings[i].binding, i);
    EXPECT_EQ(code->bindings[i].letter, "TFS"[i]);
  }
  const auto add = reflect_shader(test_shader_info(TestShader::add).spirv);
  ASSERT_TRUE(add.has_value());
  ASSERT_EQ(add->push_constants.size(), 3u);
  EXPECT_EQ(add->push_constants[2].type, "uint");
  EXPECT_EQ(add->push_constants[2].name, "amount");
  EXPECT_EQ(add->push_constants[2].offset_bytes, 8u);
}

TEST(ShaderReflection, NamesBothSidesOfADifference) {
  const ShaderInfo right = test_shader_info(TestShader::add);
  ASSERT_EQ(difference(right), "");

  ShaderInfo wrong = right;
  wrong.group_size = 32;
  expect_difference(wrong, "group size 32x1x1", "64x1x1");

  for (const char* bindings : {"", "T", "F", "SS"}) {
    wrong = right;
    wrong.bindings = bindings;
    expect_difference(wrong, "bindings \"" + std::string(bindings) + "\"", "\"S\"");
  }

  wrong = right;
  wrong.push_constants = {};
  expect_difference(wrong, "no push constant 0", "uint first at byte 0");

  std::vector<shared::Field> fields(right.push_constants.begin(), right.push_constants.end());
  wrong.push_constants = fields;
  fields[1].type = "float";
  expect_difference(wrong, "float count at byte 4", "uint count at byte 4");
  fields[1] = right.push_constants[1];
  fields[2].offset_bytes = 12;
  expect_difference(wrong, "uint amount at byte 12", "uint amount at byte 8");
  fields[2] = right.push_constants[2];
  std::swap(fields[0].name, fields[1].name);
  expect_difference(wrong, "uint count at byte 0", "uint first at byte 0");
  std::swap(fields[0].name, fields[1].name);
  fields.push_back({"vec3", "more", 12, 12});
  wrong.push_constants = fields;
  expect_difference(wrong, "vec3 more at byte 12", "no push constant 3");
}

TEST(ShaderReflection, ReportsACapabilityThatIsNotEnabled) {
  const ShaderInfo& table = test_shader_info(TestShader::add);
  auto code = reflect_shader(table.spirv);
  ASSERT_TRUE(code.has_value());
  code->capabilities.push_back(22);  // Int16
  const auto text = find_difference(table, *code);
  ASSERT_TRUE(text.has_value());
  EXPECT_NE(text->find("capability 22"), std::string::npos) << *text;
}

TEST(ShaderReflection, RefusesWordsThatAreNoSpirv) {
  EXPECT_FALSE(reflect_shader({}).has_value());
  const auto words = test_shader_info(TestShader::add).spirv;
  std::vector<std::uint32_t> changed(words.begin(), words.end());
  changed[0] ^= 1;
  EXPECT_FALSE(reflect_shader(changed).has_value());
  changed.assign(words.begin(), words.begin() + 5);  // a header and nothing else
  EXPECT_FALSE(reflect_shader(changed).has_value());
  changed.assign(words.begin(), words.end());
  changed[5] &= 0xffffu;  // an instruction without length would never end
  EXPECT_FALSE(reflect_shader(changed).has_value());
}

/// It ends and reads no other memory (sanitizers check that); its result is arbitrary.
TEST(ShaderReflection, EndsOnRandomlyChangedWords) {
  std::mt19937 random(20240711);
  std::size_t refused = 0;
  for (int round = 0; round < 4000; ++round) {
    const auto shader = static_cast<TestShader>(random() % static_cast<unsigned>(TestShader::count));
    const auto words = test_shader_info(shader).spirv;
    // A heap allocation of exactly its size, so that a sanitizer sees a read past its end.
    std::vector<std::uint32_t> changed(words.begin(), words.end());
    for (unsigned change = random() % 4; change != 0; --change)
      changed[random() % changed.size()] = random() % 512;
    changed[random() % changed.size()] ^= 1u << random() % 32;
    changed.resize(random() % 2 == 0 ? changed.size() : random() % changed.size());
    changed.shrink_to_fit();
    const auto code = reflect_shader(changed);
    if (code) {
      ShaderInfo table = test_shader_info(shader);
      table.spirv = changed;
      (void)find_difference(table, *code);
    } else {
      ++refused;
    }
  }
  EXPECT_GT(refused, 1000u);
}

TEST(TimestampDifference, WrapsAtTheValidBits) {
  EXPECT_EQ(timestamp_difference(5, 12, 64), 7);
  EXPECT_EQ(timestamp_difference(12, 5, 64), -7);
  EXPECT_EQ(timestamp_difference(~std::uint64_t{0} - 2, 4, 64), 7);
  constexpr std::uint64_t range_36 = std::uint64_t{1} << 36;
  EXPECT_EQ(timestamp_difference(range_36 - 3, 4, 36), 7);
  EXPECT_EQ(timestamp_difference(4, range_36 - 3, 36), -7);
  EXPECT_EQ(timestamp_difference((std::uint64_t{0xabc} << 36) + 1, (std::uint64_t{0xdef} << 36) + 9, 36), 8);
}

}  // namespace
}  // namespace rtstdb::gpu::test
