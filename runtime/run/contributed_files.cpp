#include "runtime/run/contributed_files.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>

#include "runtime/run/png_file.hpp"

namespace hil::run {
namespace {

namespace fs = std::filesystem;

/// The sentence why it could not be created; empty: it is there.
std::string create(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  return error ? "folder " + folder.string() + " can not be created: " + error.message() : "";
}

}  // namespace

fs::path image_folder(const fs::path& run_folder) {
  return run_folder / "images";
}
fs::path point_cloud_folder(const fs::path& run_folder) {
  return run_folder / "pointclouds";
}
fs::path other_folder(const fs::path& run_folder) {
  return run_folder / "files";
}

std::string write_file(const fs::path& file, std::string_view content) {
  errno = 0;
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  out << content;
  out.close();
  if (out) return {};
  return file.string() +
         " can not be written: " + (errno != 0 ? std::strerror(errno) : "the system gives no reason");
}

std::vector<std::string> write_files(const contribution::Contribution& contribution,
                                     const fs::path& run_folder) {
  std::vector<std::string> faults;
  const auto add = [&faults](const std::string& fault) {
    if (!fault.empty()) faults.push_back(fault);
    return fault.empty();
  };
  if (!contribution.images.empty() && add(create(image_folder(run_folder)))) {
    for (const contribution::Image& image : contribution.images)
      add(write_png({.width = image.width, .height = image.height, .pixels = PngImage::Grey8{image.grey}},
                    image_folder(run_folder) / (image.name + ".png")));
  }
  if (!contribution.files.empty() && add(create(other_folder(run_folder)))) {
    for (const contribution::File& file : contribution.files)
      add(write_file(other_folder(run_folder) / file.name, file.content));
  }
  return faults;
}

}  // namespace hil::run
