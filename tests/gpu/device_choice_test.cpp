// Which device of a list is selected.

#include "rtstdb/gpu/device_choice.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace rtstdb::gpu {
namespace {

Candidate candidate(const char* name, DeviceKind kind, const char* unsuitable = "") {
  return {.info = {.name = name, .driver = "", .api = "1.3.0", .software = kind == DeviceKind::cpu},
          .kind = kind,
          .unsuitable = unsuitable};
}

const std::vector<Candidate> laptop{
    candidate("llvmpipe (LLVM 15.0.6, 256 bits)", DeviceKind::cpu),
    candidate("Intel(R) Iris(R) Xe", DeviceKind::integrated),
    candidate("NVIDIA GeForce RTX 4070", DeviceKind::discrete),
    candidate("NVIDIA GeForce RTX 4090", DeviceKind::discrete),
    candidate("Virtio-GPU Venus", DeviceKind::virtual_gpu),
};

std::size_t chosen(std::string_view select, const std::vector<Candidate>& list) {
  const auto result = choose_device(select, list);
  EXPECT_TRUE(result.ok()) << result.error().message;
  return result ? result.value() : list.size();
}

std::string refusal(std::string_view select, const std::vector<Candidate>& list) {
  const auto result = choose_device(select, list);
  if (result) {
    ADD_FAILURE() << "selected index " << result.value();
    return {};
  }
  EXPECT_EQ(result.error().code, ErrorCode::no_device);
  return result.error().message;
}

TEST(DeviceChoice, AutoPrefersDiscreteThenIntegratedThenVirtualThenCpu) {
  auto list = laptop;
  EXPECT_EQ(chosen("auto", list), 2u);  // the lower index of two equals
  list.erase(list.begin() + 2, list.begin() + 4);
  EXPECT_EQ(chosen("auto", list), 1u);
  list.erase(list.begin() + 1);
  EXPECT_EQ(list[chosen("auto", list)].kind, DeviceKind::virtual_gpu);
  list.pop_back();
  EXPECT_EQ(list[chosen("auto", list)].kind, DeviceKind::cpu);
}

TEST(DeviceChoice, AutoIgnoresUnsuitableDevices) {
  auto list = laptop;
  list[2].unsuitable = list[3].unsuitable = "without timelineSemaphore";
  EXPECT_EQ(chosen("auto", list), 1u);
}

TEST(DeviceChoice, AcceptsAnIndex) {
  for (std::size_t i = 0; i < laptop.size(); ++i)
    EXPECT_EQ(chosen(std::to_string(i), laptop), i);
}

TEST(DeviceChoice, AcceptsPartOfANameInAnyCase) {
  EXPECT_EQ(chosen("LLVMPIPE", laptop), 0u);
  EXPECT_EQ(chosen("iris", laptop), 1u);
  EXPECT_EQ(chosen("nvidia", laptop), 2u);
}

TEST(DeviceChoice, ReadsDigitsAsAnIndex) {
  EXPECT_NE(refusal("4090", laptop).find("index 4090"), std::string::npos);
  EXPECT_EQ(chosen("RTX 4090", laptop), 3u);
  EXPECT_NE(refusal("99999999999999999999999", laptop).find("\"9999"), std::string::npos);
}

TEST(DeviceChoice, ListsTheDevicesInARefusal) {
  const std::string by_index = refusal("7", laptop);
  EXPECT_NE(by_index.find("index 7"), std::string::npos) << by_index;
  EXPECT_NE(by_index.find("2 \"NVIDIA GeForce RTX 4070\""), std::string::npos) << by_index;
  const std::string by_name = refusal("radeon", laptop);
  EXPECT_NE(by_name.find("\"radeon\""), std::string::npos) << by_name;
  EXPECT_NE(by_name.find("llvmpipe"), std::string::npos) << by_name;
}

TEST(DeviceChoice, NamesThePackageIfThereIsNoDevice) {
  const std::string message = refusal("auto", {});
  EXPECT_NE(message.find("no Vulkan device"), std::string::npos) << message;
  EXPECT_NE(message.find("mesa-vulkan-drivers"), std::string::npos) << message;
}

TEST(DeviceChoice, RefusesAnUnsuitableDeviceWithTheReason) {
  const std::vector<Candidate> old{candidate("Old GPU", DeviceKind::discrete, "Vulkan 1.1.0, not 1.3")};
  for (const char* select : {"auto", "0", "old"}) {
    const std::string message = refusal(select, old);
    EXPECT_NE(message.find("unsuitable: Vulkan 1.1.0, not 1.3"), std::string::npos) << message;
    EXPECT_NE(message.find("install"), std::string::npos) << message;
  }
}

}  // namespace
}  // namespace rtstdb::gpu
