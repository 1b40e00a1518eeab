// A kernel reads each shared struct in scalar layout and writes it back field by field.

#include <bit>
#include <cstring>

#include "shaders_generated/all_shared.h"
#include "tests/gpu/gpu_fixture.hpp"

namespace rtstdb::gpu::test {
namespace {

#include "shaders_generated/probe_words.inc"

struct SharedStruct {
  std::string_view name;
  std::span<const shared::Field> fields;
  std::size_t size_bytes;
  std::span<const std::uint32_t> probe_words;
};

// Failures name the struct instead of its bytes.
void PrintTo(const SharedStruct& shared_struct, std::ostream* out) {  // NOLINT(readability-identifier-naming)
  *out << shared_struct.name;
}

const SharedStruct shared_structs[] = {
#define SHARED_STRUCT(name) \
  {#name, shared::Layout<shared::name>::fields, sizeof(shared::name), echo_##name##_words},
#include "shaders_generated/shared_structs.inc"
#undef SHARED_STRUCT
};

/// A word of this field alone. Floats are normal numbers, since devices may change the bits of subnormals and
/// NaNs.
std::uint32_t distinct_word(const shared::Field& field, std::uint32_t serial) {
  const bool is_float = field.type == "float" || field.type.starts_with("vec");
  return is_float ? std::bit_cast<std::uint32_t>(1.5f + static_cast<float>(serial)) : 0x9e370000u + serial;
}

/// Writes distinct words at the offsets of the C++ compiler and returns them in the order of the field list.
std::vector<std::uint32_t> fill_fields(const SharedStruct& of, std::byte* at, std::uint32_t& serial) {
  std::vector<std::uint32_t> expected;
  for (const shared::Field& field : of.fields) {
    for (std::size_t offset = 0; offset < field.size_bytes; offset += sizeof(std::uint32_t)) {
      const std::uint32_t word = distinct_word(field, ++serial);
      std::memcpy(at + field.offset_bytes + offset, &word, sizeof(word));
      expected.push_back(word);
    }
  }
  return expected;
}

class Probe : public GpuTest, public testing::WithParamInterface<SharedStruct> {};

TEST_P(Probe, EchoesEveryField) {
  const SharedStruct& of = GetParam();
  Buffer values = make_buffer({.name = "values", .size_bytes = 2 * of.size_bytes, .memory = Memory::upload});
  Buffer words = make_words(2 * of.size_bytes / sizeof(std::uint32_t), 0);
  ASSERT_TRUE(values && words);
  std::uint32_t serial = 0;
  auto expected = fill_fields(of, values.host().data(), serial);
  const auto second = fill_fields(of, values.host().data() + of.size_bytes, serial);
  expected.insert(expected.end(), second.begin(), second.end());

  auto pipeline = device().create_pipeline(
      make_shader_info<NoArgs>(of.name, "probe/echo.comp", "", 1, "SS", of.probe_words));
  ASSERT_TRUE(pipeline.ok()) << pipeline.error().message;
  const Bindings bindings = make_bindings(pipeline.value(), {&values, &words});
  run([&](Recorder& recorder) { recorder.dispatch(pipeline.value(), bindings, {}, 1); });

  const auto echoed = words.host_as<std::uint32_t>();
  ASSERT_EQ(echoed.size(), expected.size());
  std::size_t next = 0;
  for (const char* which : {"first", "second"}) {
    for (const shared::Field& field : of.fields) {
      for (std::size_t part = 0; part < field.size_bytes / sizeof(std::uint32_t); ++part, ++next) {
        EXPECT_EQ(echoed[next], expected[next])
            << which << " " << of.name << "::" << field.name << " (" << field.type << "), component " << part;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(SharedStructs, Probe, testing::ValuesIn(shared_structs),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace rtstdb::gpu::test
