#include "tests/support/simulation/disk.hpp"

#include <algorithm>
#include <cerrno>
#include <utility>

namespace hil::tests {

using rtstdb::log::DiskCall;
using rtstdb::log::DiskError;
using rtstdb::log::DiskFault;
using rtstdb::log::DiskFile;
using rtstdb::log::DiskLock;
using rtstdb::log::DiskResult;

namespace {

constexpr std::uint64_t sector_bytes = 512;

DiskFault fault(DiskCall call, int number, std::string_view name) {
  if (number == 0) return std::nullopt;
  return DiskError{call, number, std::string(name)};
}

}  // namespace

class SimulatedFile final : public DiskFile {
 public:
  SimulatedFile(SimulatedDisk& disk, std::string name, std::shared_ptr<SimulatedDisk::Content> content)
      : disk_(disk), name_(std::move(name)), content_(std::move(content)), life_(disk.life_) {}

  DiskFault write(std::uint64_t offset, std::span<const std::byte> bytes) override {
    const int number = enter(DiskCall::write);
    const std::lock_guard lock(disk_.mutex_);
    if (number == ESTALE) return fault(DiskCall::write, EIO, name_);
    // A call that fails may have written a part.
    const std::size_t count = number == 0 ? bytes.size() : disk_.random_() % (bytes.size() + 1);
    const std::uint64_t end = offset + count;
    const std::uint64_t growth = end > content_->now.size() ? end - content_->now.size() : 0;
    if (growth > 0 && disk_.bytes_in_use() + growth > disk_.capacity_)
      return fault(DiskCall::write, ENOSPC, name_);
    grow(end);
    std::copy_n(bytes.begin(), count, content_->now.begin() + static_cast<std::ptrdiff_t>(offset));
    for (std::uint64_t sector = offset / sector_bytes; sector * sector_bytes < end; ++sector)
      content_->dirty.insert(sector);
    return fault(DiskCall::write, number, name_);
  }

  DiskFault preallocate(std::uint64_t bytes) override {
    const int number = enter(DiskCall::preallocate);
    const std::lock_guard lock(disk_.mutex_);
    if (number != 0) return fault(DiskCall::preallocate, number == ESTALE ? EIO : number, name_);
    const std::uint64_t growth = bytes > content_->now.size() ? bytes - content_->now.size() : 0;
    if (disk_.bytes_in_use() + growth > disk_.capacity_) return fault(DiskCall::preallocate, ENOSPC, name_);
    grow(bytes);
    return std::nullopt;
  }

  DiskFault sync() override {
    const int number = enter(DiskCall::sync);
    const std::lock_guard lock(disk_.mutex_);
    if (number == ESTALE) return fault(DiskCall::sync, EIO, name_);
    if (number != 0) {
      disk_.drop_dirty(*content_);
      return fault(DiskCall::sync, number, name_);
    }
    if (content_->size_dirty) content_->on_disk.resize(content_->now.size());
    for (const std::uint64_t sector : content_->dirty)
      SimulatedDisk::put_on_disk(*content_, sector);
    content_->dirty.clear();
    content_->size_dirty = false;
    return std::nullopt;
  }

  DiskResult<std::size_t> read(std::uint64_t offset, std::span<std::byte> bytes) override {
    if (const int number = enter(DiskCall::read)) return DiskError{DiskCall::read, number, name_};
    const std::lock_guard lock(disk_.mutex_);
    if (offset >= content_->now.size()) return std::size_t{0};
    const std::size_t count = std::min<std::size_t>(bytes.size(), content_->now.size() - offset);
    std::copy_n(content_->now.begin() + static_cast<std::ptrdiff_t>(offset), count, bytes.begin());
    return count;
  }

  DiskResult<std::uint64_t> size() override {
    if (const int number = enter(DiskCall::size)) return DiskError{DiskCall::size, number, name_};
    const std::lock_guard lock(disk_.mutex_);
    return std::uint64_t{content_->now.size()};
  }

 private:
  int enter(DiskCall call) {
    const int number = disk_.enter(call);
    return life_ == disk_.life_ ? number : ESTALE;
  }
  void grow(std::uint64_t bytes) {
    if (bytes <= content_->now.size()) return;
    content_->now.resize(bytes);
    content_->size_dirty = true;
  }

  SimulatedDisk& disk_;
  std::string name_;
  std::shared_ptr<SimulatedDisk::Content> content_;
  std::uint64_t life_;
};

class SimulatedLock final : public DiskLock {
 public:
  explicit SimulatedLock(SimulatedDisk& disk) : disk_(disk), life_(disk.life_) { disk_.locked_in_ = life_; }
  ~SimulatedLock() override {
    if (disk_.locked_in_ == life_) disk_.locked_in_ = ~std::uint64_t{0};
  }

 private:
  SimulatedDisk& disk_;
  std::uint64_t life_;
};

int SimulatedDisk::enter(DiskCall call) {
  std::function<void(DiskCall)> hook;
  {
    const std::lock_guard lock(mutex_);
    hook = hook_;
  }
  if (hook) hook(call);
  const std::lock_guard lock(mutex_);
  const std::uint64_t number = calls_++;
  if (const auto found = failing_.find(number); found != failing_.end()) return found->second;
  if (const auto found = failing_kinds_.find(call); found != failing_kinds_.end() && found->second != 0)
    return found->second;
  const bool reads = call == DiskCall::read || call == DiskCall::open || call == DiskCall::size ||
                     call == DiskCall::list || call == DiskCall::lock;
  return !reads && chance_ != 0 && random_() % 1000 < chance_ ? EIO : 0;
}

void SimulatedDisk::put_on_disk(Content& content, std::uint64_t sector) {
  const std::uint64_t begin = sector * sector_bytes;
  const std::uint64_t end = std::min<std::uint64_t>(begin + sector_bytes, content.now.size());
  if (content.on_disk.size() < end) content.on_disk.resize(end);
  std::copy(content.now.begin() + static_cast<std::ptrdiff_t>(begin),
            content.now.begin() + static_cast<std::ptrdiff_t>(end),
            content.on_disk.begin() + static_cast<std::ptrdiff_t>(begin));
}

void SimulatedDisk::drop_dirty(Content& content) {
  for (const std::uint64_t sector : content.dirty)
    if (draw()) put_on_disk(content, sector);
  if (content.size_dirty && draw() && content.on_disk.size() < content.now.size())
    content.on_disk.resize(content.now.size());
  content.dirty.clear();
  content.size_dirty = false;
}

void SimulatedDisk::apply(const Change& change, Names& names) {
  if (change.from.empty()) {
    names[change.to] = change.content;
    return;
  }
  const auto found = names.find(change.from);
  if (found == names.end() || found->second != change.content) return;
  names.erase(found);
  if (!change.to.empty()) names[change.to] = change.content;
}

void SimulatedDisk::crash() {
  const std::lock_guard lock(mutex_);
  ++life_;
  for (const Change& change : changes_)
    if (draw()) apply(change, on_disk_);
  changes_.clear();
  now_ = on_disk_;
  for (auto& [name, content] : now_) {
    drop_dirty(*content);
    content->now = content->on_disk;
  }
}

std::uint64_t SimulatedDisk::bytes_in_use() const {
  std::uint64_t bytes = 0;
  for (const auto& [name, content] : now_)
    bytes += content->now.size();
  return bytes;
}

std::map<std::string, std::vector<std::byte>> SimulatedDisk::contents() const {
  const std::lock_guard lock(mutex_);
  std::map<std::string, std::vector<std::byte>> contents;
  for (const auto& [name, content] : now_)
    contents[name] = content->now;
  return contents;
}

void SimulatedDisk::set_contents(const std::map<std::string, std::vector<std::byte>>& contents) {
  const std::lock_guard lock(mutex_);
  ++life_;
  now_.clear();
  changes_.clear();
  for (const auto& [name, bytes] : contents) {
    auto content = std::make_shared<Content>();
    content->now = content->on_disk = bytes;
    now_[name] = std::move(content);
  }
  on_disk_ = now_;
}

// ---- the directory

DiskResult<std::unique_ptr<DiskFile>> SimulatedDisk::create(std::string_view name) {
  if (const int number = enter(DiskCall::create)) return *fault(DiskCall::create, number, name);
  const std::lock_guard lock(mutex_);
  if (now_.find(name) != now_.end()) return *fault(DiskCall::create, EEXIST, name);
  auto content = std::make_shared<Content>();
  changes_.push_back({"", std::string(name), content});
  apply(changes_.back(), now_);
  return std::unique_ptr<DiskFile>(
      std::make_unique<SimulatedFile>(*this, std::string(name), std::move(content)));
}

DiskResult<std::unique_ptr<DiskFile>> SimulatedDisk::open(std::string_view name) {
  if (const int number = enter(DiskCall::open)) return *fault(DiskCall::open, number, name);
  const std::lock_guard lock(mutex_);
  const auto found = now_.find(name);
  if (found == now_.end()) return *fault(DiskCall::open, ENOENT, name);
  return std::unique_ptr<DiskFile>(std::make_unique<SimulatedFile>(*this, std::string(name), found->second));
}

DiskResult<std::vector<std::string>> SimulatedDisk::list() {
  if (const int number = enter(DiskCall::list)) return *fault(DiskCall::list, number, ".");
  const std::lock_guard lock(mutex_);
  std::vector<std::string> names;
  for (const auto& [name, content] : now_)
    names.push_back(name);
  return names;
}

DiskFault SimulatedDisk::rename(std::string_view from, std::string_view to) {
  if (const int number = enter(DiskCall::rename)) return fault(DiskCall::rename, number, from);
  const std::lock_guard lock(mutex_);
  const auto found = now_.find(from);
  if (found == now_.end()) return fault(DiskCall::rename, ENOENT, from);
  changes_.push_back({std::string(from), std::string(to), found->second});
  apply(changes_.back(), now_);
  return std::nullopt;
}

DiskFault SimulatedDisk::remove(std::string_view name) {
  if (const int number = enter(DiskCall::remove)) return fault(DiskCall::remove, number, name);
  const std::lock_guard lock(mutex_);
  const auto found = now_.find(name);
  if (found == now_.end()) return fault(DiskCall::remove, ENOENT, name);
  changes_.push_back({std::string(name), "", found->second});
  apply(changes_.back(), now_);
  return std::nullopt;
}

DiskFault SimulatedDisk::sync_directory() {
  const int number = enter(DiskCall::sync_directory);
  const std::lock_guard lock(mutex_);
  // A sync that fails may have written the first changes; journals keep the others for the next sync.
  const std::size_t written = number == 0 ? changes_.size() : random_() % (changes_.size() + 1);
  const auto end = changes_.begin() + static_cast<std::ptrdiff_t>(written);
  std::for_each(changes_.begin(), end, [this](const Change& change) { apply(change, on_disk_); });
  changes_.erase(changes_.begin(), end);
  return fault(DiskCall::sync_directory, number, ".");
}

DiskResult<std::unique_ptr<DiskLock>> SimulatedDisk::lock(std::string_view name) {
  if (const int number = enter(DiskCall::lock)) return *fault(DiskCall::lock, number, name);
  const std::lock_guard guard(mutex_);
  if (locked_in_ == life_) return *fault(DiskCall::lock, EWOULDBLOCK, name);
  return std::unique_ptr<DiskLock>(std::make_unique<SimulatedLock>(*this));
}

}  // namespace hil::tests
