#include "runtime/run/run_folder.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "io/device.hpp"
#include "runtime/run/contributed_files.hpp"

namespace hil::run {
namespace {

namespace fs = std::filesystem;

constexpr const char* report_names[] = {"report.json", "report.html", "junit.xml"};

/// The first link in the folder, without those in folders inside it; empty: there is none.
fs::path link_in(const fs::path& directory) {
  std::error_code error;
  for (auto entry = fs::directory_iterator(directory, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    std::error_code ignored;
    if (entry->is_symlink(ignored)) return entry->path();
  }
  return {};
}

bool is_log_file(const std::string& name) {
  return name == "lock" || name.starts_with("segment.") || name.starts_with("checkpoint.") ||
         name.starts_with("geometry.");
}

/// Removes the files of a log, and then the folder. Refuses a folder with other files.
void remove_log(const fs::path& directory) {
  std::error_code error;
  if (!fs::exists(directory, error)) return;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, error))
    if (is_log_file(entry.path().filename().string())) fs::remove(entry.path(), error);
  error.clear();
  const auto left = fs::directory_iterator(directory, error);
  if (!error && left != fs::directory_iterator())
    throw io::DeviceError(directory.string() +
                          " is the folder of the database's log, but contains another file: " +
                          left->path().filename().string() + "; move it away or use another --out");
  fs::remove(directory, error);
  if (error)
    throw io::DeviceError(directory.string() + " of an earlier run can not be removed: " + error.message());
}

/// "scan-2.svg": a picture of a section of the report.
bool is_section_picture(const std::string& name) {
  const std::size_t dash = name.rfind('-');
  if (dash == std::string::npos || !name.ends_with(".svg")) return false;
  const std::string_view number = std::string_view(name).substr(dash + 1, name.size() - dash - 5);
  return !number.empty() && number.find_first_not_of("0123456789") == std::string_view::npos;
}

void remove_result(const fs::path& file) {
  std::error_code error;
  fs::remove(file, error);
  if (error)
    throw io::DeviceError(file.string() + " of an earlier run can not be removed: " + error.message());
}

/// Removes the files with this extension (null: all), and the folder when it is then empty.
void remove_files(const fs::path& directory, const char* extension) {
  std::error_code error;
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, error))
    if (entry.is_regular_file() && (extension == nullptr || entry.path().extension() == extension))
      files.push_back(entry.path());
  for (const fs::path& file : files)
    remove_result(file);
  fs::remove(directory, error);  // fails, and stays, with other files in it
}

}  // namespace

fs::path database_folder(const fs::path& run_folder) {
  return run_folder / "database";
}

void require_no_links(const fs::path& run_folder) {
  for (const fs::path& folder :
       {run_folder, run_folder / "pictures", database_folder(run_folder), image_folder(run_folder),
        point_cloud_folder(run_folder), other_folder(run_folder)}) {
    const fs::path link = link_in(folder);
    if (link.empty()) continue;
    std::error_code ignored;
    throw io::DeviceError(link.string() + " is a link to " + fs::read_symlink(link, ignored).string() +
                          "; a run writes only into its own folder: remove the link, or use another folder");
  }
}

RunFolder::RunFolder(const fs::path& directory) : directory_(directory) {
  std::error_code error;
  fs::create_directories(directory, error);
  if (error)
    throw io::DeviceError("folder " + directory.string() + " can not be created: " + error.message());
  lock_ = ::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (lock_ < 0) {
    throw io::DeviceError("folder " + directory.string() + " can not be opened: " + std::strerror(errno));
  }
  if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    const int error_number = errno;
    ::close(lock_);
    throw io::DeviceError("folder " + directory.string() +
                          (error_number == EWOULDBLOCK
                               ? std::string(" is in use by another run")
                               : " can not be locked: " + std::string(std::strerror(error_number))));
  }
  try {
    require_no_links(directory);
  } catch (const io::DeviceError&) {
    for (const char* file : report_names)
      if (!fs::is_symlink(directory / file, error)) fs::remove(directory / file, error);
    ::close(lock_);
    throw;
  }
}

void RunFolder::clear() const {
  clear_reports();
  for (const char* file : {"trace.json", "world.json", "run.log", "recording.mcap", "pictures/top-view.svg"})
    remove_result(directory_ / file);
  std::error_code error;
  std::vector<fs::path> pictures;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory_ / "pictures", error))
    if (is_section_picture(entry.path().filename().string())) pictures.push_back(entry.path());
  for (const fs::path& picture : pictures)
    remove_result(picture);
  remove_files(point_cloud_folder(directory_), ".pcd");
  remove_files(image_folder(directory_), ".png");
  remove_files(other_folder(directory_), nullptr);
  remove_log(database_folder(directory_));
}

void RunFolder::clear_reports() const {
  for (const char* file : report_names)
    remove_result(directory_ / file);
}

RunFolder::~RunFolder() {
  ::close(lock_);
}

}  // namespace hil::run
