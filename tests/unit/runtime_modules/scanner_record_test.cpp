// A scanner's record is written to world.json and read back; a damaged record is refused with the name of its
// property.

#include "runtime/modules/laser_scanner/scanner_record.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace hil::modules {
namespace {

const ScannerRecord lidar{.name = "lidar",
                          .carrier_index = 11,
                          .carrier_generation = 3,
                          .mount_m = {1.5, -0.1, 0.85},
                          .columns = 480,
                          .rows = 270,
                          .horizontal_rad = 2.44346,
                          .vertical_rad = 0.69813,
                          .elevation_rad = -0.1,
                          .left_to_right = false,
                          .range_m = 120.0,
                          .mask = 0xFFFF'FFFFU,
                          .ignore_motion = true,
                          .divergence_rad = 0.01,
                          .returns_per_beam = 3,
                          .fast_beams = true,
                          .threshold_per_m2 = 1e-6,
                          .range_noise_m = 0.02,
                          .noise_seed = 0x1234'5678'9ABC'DEF0,
                          .first_sweep_ns = 10,
                          .sweep_ns = 20,
                          .step_ns = 5};

contribution::Property& property(contribution::ModuleRecord& record, const std::string& key) {
  return *std::ranges::find(record.properties, key, &contribution::Property::key);
}

std::string refusal(const contribution::ModuleRecord& record) {
  try {
    to_scanner_record(record);
  } catch (const RecordError& error) {
    return error.what();
  }
  return {};
}

TEST(ScannerRecord, IsReadBackAsWritten) {
  const contribution::ModuleRecord record = to_module_record(lidar);
  EXPECT_EQ(record.list, "scanners");
  const ScannerRecord read = to_scanner_record(record);
  EXPECT_EQ(read.name, "lidar");
  EXPECT_EQ(read.mount_m, lidar.mount_m);
  EXPECT_EQ(read.mask, lidar.mask);
  EXPECT_EQ(read.horizontal_rad, lidar.horizontal_rad);
  EXPECT_EQ(read.left_to_right, false);
  EXPECT_EQ(read.returns_per_beam, 3u);
  EXPECT_TRUE(read.fast_beams);
  EXPECT_EQ(read.noise_seed, lidar.noise_seed);
  EXPECT_EQ(to_module_record(read).properties.size(), record.properties.size());
  for (std::size_t i = 0; i < record.properties.size(); ++i)
    EXPECT_EQ(to_module_record(read).properties[i].value, record.properties[i].value);
}

/// world.json holds the mode as a flag, whose key and type recordings depend on.
TEST(ScannerRecord, ModeIsThePropertyFastBeams) {
  contribution::ModuleRecord record = to_module_record(lidar);
  EXPECT_EQ(std::get<bool>(property(record, "fast_beams").value), true);
  property(record, "fast_beams").value = false;
  EXPECT_FALSE(to_scanner_record(record).fast_beams);
  property(record, "fast_beams").value = std::int64_t{1};
  EXPECT_EQ(refusal(record),
            "world.json: scanner 'lidar': property 'fast_beams' has a value of another type or range");
}

TEST(ScannerRecord, DamagedPropertyIsRefusedWithItsName) {
  contribution::ModuleRecord record = to_module_record(lidar);
  property(record, "columns").value = 480.5;
  EXPECT_EQ(refusal(record),
            "world.json: scanner 'lidar': property 'columns' has a value of another type or range");
  property(record, "columns").value = std::int64_t{-1};
  EXPECT_EQ(refusal(record),
            "world.json: scanner 'lidar': property 'columns' has a value of another type or range");
  property(record, "columns").value = std::int64_t{1};
  EXPECT_NE(refusal(record).find("1 columns of 270 beams is beyond the limits"), std::string::npos)
      << refusal(record);
  record = to_module_record(lidar);
  property(record, "range_m").value = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(refusal(record).find("the range"), std::string::npos) << refusal(record);
  record = to_module_record(lidar);
  property(record, "returns_per_beam").value = std::int64_t{9};
  EXPECT_NE(refusal(record).find("9 returns of a beam"), std::string::npos) << refusal(record);
  record = to_module_record(lidar);
  property(record, "divergence_rad").value = 2.0;
  EXPECT_NE(refusal(record).find("the divergence"), std::string::npos) << refusal(record);
  record.properties.pop_back();
  EXPECT_EQ(refusal(record), "world.json: scanner 'lidar': property 'step_ns' is missing");
}

}  // namespace
}  // namespace hil::modules
