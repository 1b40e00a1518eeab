#include "runtime/plugins/plugin_file.hpp"

#include <elf.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#define XXH_INLINE_ALL
#include <xxhash.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string_view>

#include <hil/plugin.hpp>

namespace hil::plugins {
namespace {

static_assert(std::string_view(abi).starts_with("hil " HIL_MINOR_VERSION ","),
              "the version in HIL_ABI is that of the project");

/// A copy of the struct at `offset`; empty: the bytes end before it does.
template <class Struct>
std::optional<Struct> struct_at(std::string_view bytes, std::uint64_t offset) {
  if (offset > bytes.size() || bytes.size() - offset < sizeof(Struct)) return std::nullopt;
  Struct copy;
  std::memcpy(&copy, bytes.data() + offset, sizeof copy);
  return copy;
}

/// The part of the bytes, as far as they reach.
std::string_view part_of(std::string_view bytes, std::uint64_t offset, std::uint64_t size) {
  return offset >= bytes.size() ? std::string_view() : bytes.substr(offset, size);
}

std::string value_of(std::string_view text, std::string_view key) {
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = text.substr(begin, end - begin);
    if (line.starts_with(key)) return std::string(line.substr(key.size()));
    begin = end + 1;
  }
  return {};
}

constexpr std::size_t aligned(std::uint32_t bytes) noexcept {
  return (std::size_t{bytes} + 3) / 4 * 4;
}

/// The text of hil's note in a segment of notes.
std::optional<std::string_view> hil_note_in(std::string_view notes) {
  while (const auto head = struct_at<Elf64_Nhdr>(notes, 0)) {
    const std::size_t text_at = sizeof(Elf64_Nhdr) + aligned(head->n_namesz);
    const std::string_view name = part_of(notes, sizeof(Elf64_Nhdr), head->n_namesz);
    if (name == std::string_view("hil\0", 4) && head->n_type == 1)
      return part_of(notes, text_at, head->n_descsz);
    const std::size_t next = text_at + aligned(head->n_descsz);
    if (next >= notes.size()) break;
    notes.remove_prefix(next);
  }
  return std::nullopt;
}

/// The content of a file, mapped while it is read.
class MappedFile {
 public:
  explicit MappedFile(const std::filesystem::path& path) {
    const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    struct stat status {};
    if (file < 0 || ::fstat(file, &status) != 0) {
      fault_ = std::strerror(errno);
    } else if (!S_ISREG(status.st_mode)) {
      fault_ = "it is no regular file";
    } else if (static_cast<std::uint64_t>(status.st_size) > max_plugin_bytes) {
      fault_ = "it is larger than 1 GiB";
    } else if (status.st_size > 0) {
      size_ = static_cast<std::size_t>(status.st_size);
      memory_ = ::mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, file, 0);
      if (memory_ == MAP_FAILED) fault_ = std::strerror(errno);
    }
    if (file >= 0) ::close(file);
  }
  ~MappedFile() {
    if (size_ > 0 && memory_ != MAP_FAILED) ::munmap(memory_, size_);
  }
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  const std::string& fault() const noexcept { return fault_; }
  std::string_view bytes() const noexcept { return {static_cast<const char*>(memory_), size_}; }

 private:
  void* memory_ = nullptr;
  std::size_t size_ = 0;
  std::string fault_;
};

}  // namespace

std::optional<PluginNote> read_note(std::string_view elf, std::string& fault) {
  const auto head = struct_at<Elf64_Ehdr>(elf, 0);
  if (!head || std::memcmp(head->e_ident, ELFMAG, SELFMAG) != 0) {
    fault = "it is no ELF file";
    return std::nullopt;
  }
#ifdef __aarch64__
  constexpr Elf64_Half machine = EM_AARCH64;
#else
  constexpr Elf64_Half machine = EM_X86_64;
#endif
  if (head->e_ident[EI_CLASS] != ELFCLASS64 || head->e_machine != machine || head->e_type != ET_DYN) {
    fault = "it is no shared library for this processor";
    return std::nullopt;
  }
  for (std::uint64_t i = 0; i < head->e_phnum; ++i) {
    const auto segment = struct_at<Elf64_Phdr>(elf, head->e_phoff + i * sizeof(Elf64_Phdr));
    if (!segment) break;
    if (segment->p_type != PT_NOTE) continue;
    const auto text = hil_note_in(part_of(elf, segment->p_offset, segment->p_filesz));
    if (!text) continue;
    PluginNote note{value_of(*text, "abi="), value_of(*text, "name="), value_of(*text, "version=")};
    if (!note.abi.empty() && !note.name.empty()) return note;
  }
  fault = "it is no plug-in of hil (HIL_PLUGIN is missing)";
  return std::nullopt;
}

std::optional<PluginIdentity> read_plugin(const std::filesystem::path& path, std::string& fault) {
  const MappedFile file(path);
  std::string why = file.fault();
  std::optional<PluginNote> note;
  if (why.empty()) note = read_note(file.bytes(), why);
  if (note && note->abi != abi)
    why = "it was compiled for '" + note->abi + "', this program is '" + abi + "': compile it again";
  if (!why.empty()) {
    fault = path.string() + " can not be loaded: " + why;
    return std::nullopt;
  }
  char hash[32];
  std::snprintf(hash, sizeof hash, "%016llx",
                static_cast<unsigned long long>(XXH64(file.bytes().data(), file.bytes().size(), 0)));
  return PluginIdentity{note->name, note->version, path.string(), hash};
}

}  // namespace hil::plugins
