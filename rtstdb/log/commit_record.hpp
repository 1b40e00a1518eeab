#pragma once
// A commit's write set to bytes and back. One that moves an entity and does nothing else, as most small ones do, is told in fewer
// bytes than the rest.
//
// Writing: the size is known beforehand; nothing allocates, nothing can fail. Reading trusts nothing (see record.hpp).

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "rtstdb/log/format.hpp"
#include "rtstdb/store/write_set.hpp"

namespace rtstdb::log {

/// How a set is told. It has been staged.
struct CommitForm {
  RecordKind kind = RecordKind::commit;  ///< or move
  std::uint16_t left_out = 0;            ///< of a move
  std::size_t bytes = 0;
};
/// As a commit, as any set may be.
CommitForm commit_form_of(const store::WriteSet& set) noexcept;
/// As a move where it is one. `time_before`: of the commit that is told before it, where nothing but geometries lies between them.
CommitForm form_of(const store::WriteSet& set, const std::optional<WorldTime>& time_before) noexcept;
/// Of a set that has not been staged, in whatever form.
std::size_t max_commit_bytes(const store::WriteSet& set) noexcept;
/// Room for just as many bytes as the form says.
void encode_commit(const store::WriteSet& set, const CommitForm& form, std::span<std::byte> room) noexcept;

/// Commits in the order in which they were told.
class CommitDecoder {
 public:
  explicit CommitDecoder(std::optional<WorldTime> time_before) : time_before_(time_before) {}

  // What is wrong, or null. The set's shapes stay until the next call.
  [[nodiscard]] const char* decode_commit(std::span<const std::byte> body, store::WriteSet& set);
  [[nodiscard]] const char* decode_move(std::uint16_t left_out, std::span<const std::byte> body,
                                        store::WriteSet& set);
  /// The next one has to tell its world time.
  void forget_time() noexcept { time_before_.reset(); }

 private:
  std::optional<WorldTime> time_before_;
  std::vector<glm::vec3> positions_m_;  // of all shapes of the commit
};

}  // namespace rtstdb::log
