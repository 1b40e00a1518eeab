// The notes of plug-ins: of right files, and of files that are cut off, changed, or built to mislead.

#include "runtime/plugins/plugin_file.hpp"

#include <elf.h>
#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <string>

#include <hil/plugin.hpp>

#include "tests/paths.h"

namespace hil::plugins {
namespace {

/// An ELF file with one segment of notes.
std::string elf_with(const std::string& notes) {
  Elf64_Ehdr head{};
  std::memcpy(head.e_ident, ELFMAG, SELFMAG);
  head.e_ident[EI_CLASS] = ELFCLASS64;
#ifdef __aarch64__
  head.e_machine = EM_AARCH64;
#else
  head.e_machine = EM_X86_64;
#endif
  head.e_type = ET_DYN;
  head.e_phoff = sizeof head;
  head.e_phnum = 2;
  Elf64_Phdr load{}, note{};
  load.p_type = PT_LOAD;
  note.p_type = PT_NOTE;
  note.p_offset = sizeof head + 2 * sizeof note;
  note.p_filesz = notes.size();
  std::string bytes(note.p_offset, '\0');
  std::memcpy(bytes.data(), &head, sizeof head);
  std::memcpy(bytes.data() + sizeof head, &load, sizeof load);
  std::memcpy(bytes.data() + sizeof head + sizeof load, &note, sizeof note);
  return bytes + notes;
}

std::string note_of(const std::string& owner, const std::string& text, std::uint32_t type = 1) {
  const Elf64_Nhdr head{static_cast<Elf64_Word>(owner.size() + 1), static_cast<Elf64_Word>(text.size()),
                        type};
  const auto padded = [](std::string part) { return part.append((4 - part.size() % 4) % 4, '\0'); };
  return std::string(reinterpret_cast<const char*>(&head), sizeof head) + padded(owner + '\0') + padded(text);
}

const std::string good_text = "abi=x, y\nname=pumps\nversion=1.2\n";

TEST(PluginNotes, AreFoundBehindOthers) {
  std::string fault;
  const auto note = read_note(
      elf_with(note_of("GNU", std::string(20, 'b')) + note_of("hil", "other", 2) + note_of("hil", good_text)),
      fault);
  ASSERT_TRUE(note) << fault;
  EXPECT_EQ(note->abi, "x, y");
  EXPECT_EQ(note->name, "pumps");
  EXPECT_EQ(note->version, "1.2");
}

TEST(PluginNotes, OtherFilesAreRefused) {
  const auto fault_of = [](const std::string& bytes) {
    std::string fault;
    EXPECT_FALSE(read_note(bytes, fault));
    return fault;
  };
  EXPECT_EQ(fault_of(""), "it is no ELF file");
  EXPECT_EQ(fault_of(std::string(4096, 'x')), "it is no ELF file");
  std::string program = elf_with(note_of("hil", good_text));
  program[offsetof(Elf64_Ehdr, e_type)] = ET_REL;
  EXPECT_EQ(fault_of(program), "it is no shared library for this processor");
  EXPECT_EQ(fault_of(elf_with(note_of("GNU", "x"))), "it is no plug-in of hil (HIL_PLUGIN is missing)");
  EXPECT_EQ(fault_of(elf_with(note_of("hil", "name=pumps\n"))),
            "it is no plug-in of hil (HIL_PLUGIN is missing)");
}

TEST(PluginNotes, FilesThatAreCutOffAreReadAsFarAsTheyGo) {
  const std::string whole = elf_with(note_of("GNU", "1234") + note_of("hil", good_text));
  for (std::size_t size = 0; size < whole.size(); ++size) {
    std::string fault;
    const auto note = read_note(whole.substr(0, size), fault);
    EXPECT_EQ(note.has_value(), fault.empty()) << size;
  }
}

TEST(PluginNotes, ChangedFilesNeverLeadOutOfTheBytes) {
  const std::string whole = elf_with(note_of("GNU", "1234") + note_of("hil", good_text));
  std::mt19937_64 random(75);
  int refused = 0;
  for (int round = 0; round < 50'000; ++round) {
    std::string changed = whole;
    for (std::uint64_t k = random() % 4; k < 4; ++k) {
      const std::size_t at = random() % changed.size();
      // Sizes and offsets near the ends of their types, too.
      if (random() % 3 == 0 && at + 8 <= changed.size()) {
        const std::uint64_t value = ~std::uint64_t{0} - random() % 64;
        std::memcpy(changed.data() + at, &value, random() % 2 == 0 ? 8 : 4);
      } else {
        changed[at] = static_cast<char>(random());
      }
    }
    changed.resize(changed.size() - random() % 16);
    // A copy of its own size, so that a sanitizer sees each byte beyond it.
    const std::vector<char> exact(changed.begin(), changed.end());
    std::string fault;
    const auto note = read_note({exact.data(), exact.size()}, fault);
    EXPECT_EQ(note.has_value(), fault.empty());
    refused += note ? 0 : 1;
  }
  EXPECT_GT(refused, 5'000);
  EXPECT_LT(refused, 50'000);
}

TEST(PluginFiles, SayTheirNameVersionAndHash) {
  std::string fault;
  const auto pump = read_plugin(HIL_BINARY_DIR "/tests/plugins/pump.so", fault);
  ASSERT_TRUE(pump) << fault;
  EXPECT_EQ(pump->name, "pumps");
  EXPECT_EQ(pump->version, "1.2.3");
  EXPECT_EQ(pump->hash.size(), 16U);
  const auto docking = read_plugin(HIL_BINARY_DIR "/plugins/docking.so", fault);
  ASSERT_TRUE(docking) << fault;
  EXPECT_NE(docking->hash, pump->hash);
}

TEST(PluginFiles, ThoseOfAnotherAbiAreRefusedWithBoth) {
  std::string fault;
  EXPECT_FALSE(read_plugin(HIL_BINARY_DIR "/tests/plugins/other_abi.so", fault));
  EXPECT_NE(fault.find("other_abi.so can not be loaded: it was compiled for 'hil 0.0, C++ ABI"),
            std::string::npos)
      << fault;
  EXPECT_NE(fault.find("this program is '" + std::string(abi) + "': compile it again"), std::string::npos);
  fault.clear();
  EXPECT_FALSE(read_plugin("/nowhere/x.so", fault));
  EXPECT_EQ(fault, "/nowhere/x.so can not be loaded: No such file or directory");
  fault.clear();
  EXPECT_FALSE(read_plugin(HIL_BINARY_DIR, fault));
  EXPECT_NE(fault.find("can not be loaded: "), std::string::npos) << fault;
}

}  // namespace
}  // namespace hil::plugins
