#pragma once
// The GPU in few nouns: device, buffer, pipeline (with its bindings), recorder, timeline. This room is the
// only place that names Vulkan; its headers do not. One queue, compute and copies only.
//
// Threads: creation calls from any one thread at a time (setup). A Recorder and a Timeline belong to one
// thread. Lost device: after DeviceLost every object of that device only may be destroyed.

#include <glm/ext/vector_uint2.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include <rtstdb/database.hpp>
#include <rtstdb/result.hpp>

#include "rtstdb/gpu/host_memory.hpp"
#include "rtstdb/gpu/shader.hpp"

namespace rtstdb::gpu {

enum class Memory : std::uint8_t {
  device,    ///< only shaders and copies touch it
  upload,    ///< the host writes, shaders read; mapped and coherent
  readback,  ///< shaders write, the host reads; mapped, coherent, cached where the device has it
};

/// How shaders see a buffer. Read-mostly data is fetched as texels: far faster than storage loads on lavapipe
/// (docs/decisions), and the same buffer may be storage for the pass that writes it.
enum class View : std::uint8_t { storage, texel_uint4, texel_float4 };

struct BufferOptions {
  std::string name;  ///< for validation messages and captures
  std::size_t size_bytes = 0;
  Memory memory = Memory::device;
  bool texel_uint4 = false;   ///< may be bound as View::texel_uint4
  bool texel_float4 = false;  ///< may be bound as View::texel_float4
  bool texel_image = false;   ///< with texel_uint4: shaders may load and store whole texels of an image
  bool indirect = false;      ///< may hold dispatch counts
  bool addressed = false;     ///< shaders may be given its address
  /// The buffer's bytes are these, at least size_bytes, which outlive it. Memory::upload or readback. Where the device
  /// can not take memory of the host in, it has bytes of its own, and push and pull copy.
  const HostMemory* host = nullptr;
};

class Buffer {
 public:
  Buffer();
  ~Buffer();
  Buffer(Buffer&&) noexcept;
  Buffer& operator=(Buffer&&) noexcept;
  explicit operator bool() const noexcept { return impl_ != nullptr; }
  std::size_t size_bytes() const noexcept;
  /// The mapped bytes; misuse for Memory::device.
  std::span<std::byte> host() const noexcept;
  /// Of a buffer over memory of the host: what stands there is what the device will read; what the device wrote stands
  /// there. Nothing to do where the device took that memory in.
  void push(std::size_t offset_bytes, std::size_t size_bytes) const noexcept;
  void pull(std::size_t offset_bytes, std::size_t size_bytes) const noexcept;
  /// Where that byte is, low word first, for shaders; misuse unless `addressed`. Nothing checks what they write by it.
  glm::uvec2 address(std::size_t offset_bytes = 0) const noexcept;
  template <class T>
  std::span<T> host_as() const noexcept {
    const auto bytes = host();
    return {reinterpret_cast<T*>(bytes.data()), bytes.size() / sizeof(T)};
  }
  struct Impl;

 private:
  friend class Device;
  friend class Recorder;
  std::unique_ptr<Impl> impl_;
};

/// A buffer that is to be made, and where it goes.
struct BufferWanted {
  Buffer* buffer = nullptr;
  BufferOptions options;
};

/// What a storage binding sees of a buffer; texel bindings always see all of it. Offsets are multiples of
/// DeviceLimits::storage_alignment_bytes.
struct BufferPart {
  const Buffer* buffer = nullptr;
  std::size_t offset_bytes = 0;
  std::size_t size_bytes = 0;  ///< 0: to the end
};

/// One compute shader of the table, ready to run.
class Pipeline {
 public:
  Pipeline();
  ~Pipeline();
  Pipeline(Pipeline&&) noexcept;
  Pipeline& operator=(Pipeline&&) noexcept;
  explicit operator bool() const noexcept { return impl_ != nullptr; }
  std::uint32_t group_size() const noexcept;
  struct Impl;

 private:
  friend class Device;
  friend class Recorder;
  std::unique_ptr<Impl> impl_;
};

/// The buffers of one pipeline's bindings, in the order of the shader table. The buffers must outlive it.
class Bindings {
 public:
  Bindings();
  ~Bindings();
  Bindings(Bindings&&) noexcept;
  Bindings& operator=(Bindings&&) noexcept;
  explicit operator bool() const noexcept { return impl_ != nullptr; }
  struct Impl;

 private:
  friend class Device;
  friend class Recorder;
  std::unique_ptr<Impl> impl_;
};

/// Records commands into one re-usable command buffer, which may be submitted any number of times. A later
/// submission of the same device sees everything that an earlier one wrote, so barriers are needed only
/// inside. What was recorded must outlive its last submission: pipelines, bindings, buffers. Destroying a
/// recorder waits for its submission. Nothing here allocates memory of this room's own after creation.
class Recorder {
 public:
  Recorder();
  ~Recorder();
  Recorder(Recorder&&) noexcept;
  Recorder& operator=(Recorder&&) noexcept;
  explicit operator bool() const noexcept { return impl_ != nullptr; }

  static constexpr std::uint32_t max_timestamps = 16;

  /// Starts anew. Misuse while a submission of this recorder is not finished.
  void begin();
  /// `groups` workgroups of the pipeline's group size, at most DeviceLimits::max_groups; 0 records nothing.
  /// Push constants: exactly the struct's bytes, {} where there are none.
  void dispatch(const Pipeline& pipeline, const Bindings& bindings, std::span<const std::byte> push_constants,
                std::uint32_t groups);
  template <class Args>
  requires(std::is_trivially_copyable_v<Args> &&
           !std::is_convertible_v<Args, std::span<const std::byte>>) void dispatch(const Pipeline& pipeline,
                                                                                   const Bindings& bindings,
                                                                                   const Args& args,
                                                                                   std::uint32_t groups) {
    dispatch(pipeline, bindings, std::as_bytes(std::span(&args, 1)), groups);
  }
  /// Groups from three uint32 at `offset_bytes`, a multiple of 4, of a buffer made for it. The shader that
  /// writes them keeps to DeviceLimits::max_groups.
  void dispatch_indirect(const Pipeline& pipeline, const Bindings& bindings,
                         std::span<const std::byte> push_constants, const Buffer& counts,
                         std::size_t offset_bytes);
  template <class Args>
  requires(std::is_trivially_copyable_v<Args> &&
           !std::is_convertible_v<
               Args, std::span<const std::byte>>) void dispatch_indirect(const Pipeline& pipeline,
                                                                         const Bindings& bindings,
                                                                         const Args& args,
                                                                         const Buffer& counts,
                                                                         std::size_t offset_bytes) {
    dispatch_indirect(pipeline, bindings, std::as_bytes(std::span(&args, 1)), counts, offset_bytes);
  }
  /// What was recorded before is finished and visible before what comes after. Without one, two commands may
  /// run at once. The host's reads after the submission need none.
  void barrier();
  /// Going over a buffer's end is misuse. Zero bytes record nothing. The ranges must not overlap.
  void copy(const Buffer& from, std::size_t from_offset, const Buffer& to, std::size_t to_offset,
            std::size_t size_bytes);
  /// Offset and size are multiples of 4.
  void fill(const Buffer& buffer, std::size_t offset_bytes, std::size_t size_bytes, std::uint32_t word);
  /// The instant at which everything recorded before is finished; each slot once per begin.
  void timestamp(std::uint32_t slot);
  void end();

  struct Impl;

 private:
  friend class Device;
  friend class Timeline;
  std::unique_ptr<Impl> impl_;
};

enum class WaitResult : std::uint8_t { done, timeout, lost };

/// The order in which submissions finish: each has a number, and a later number finishes later. Several
/// timelines of one device share its queue: their submissions take turns, a submit may wait for another's.
/// Destroying a timeline waits for its submissions.
class Timeline {
 public:
  Timeline();
  ~Timeline();
  Timeline(Timeline&&) noexcept;
  Timeline& operator=(Timeline&&) noexcept;
  explicit operator bool() const noexcept { return impl_ != nullptr; }

  /// Returns the submission's number, or 0 when the device is lost (any failure counts as lost: nobody knows
  /// what was done). Misuse: a recorder that was not ended, or whose last submission is not finished.
  std::uint64_t submit(Recorder& recorder);
  /// Zero or less asks and does not wait. Misuse: a number that submit has not returned. Number 0 is done, or
  /// lost when the device is.
  WaitResult wait(std::uint64_t number, std::int64_t timeout_ns);
  /// Nanoseconds between two timestamps of the last submission of `recorder`, which must be finished and have
  /// both; negative when `to_slot` came first. 0 when the device is lost.
  std::int64_t elapsed_ns(const Recorder& recorder, std::uint32_t from_slot, std::uint32_t to_slot) const;

  struct Impl;

 private:
  friend class Device;
  friend class Recorder;
  std::shared_ptr<Impl> impl_;  // a recorder in flight knows where it was submitted
};

struct Kernel;

struct DeviceOptions {
  std::string select = "auto";  ///< see DatabaseOptions::gpu
  bool validation = false;
  /// The Vulkan loader, opened at run time and never closed. Tests put one in that fails on demand.
  std::string loader_library = "libvulkan.so.1";
  std::vector<std::byte> compiled = {};  ///< see Device::compiled
  bool takes_in_host_memory = true;      ///< false: as on a device that can not, to test that
  bool lanes_work_together = true;       ///< false: as where subgroups are of a size that no kernel is for
  std::uint32_t processors = 0;          ///< see DeviceLimits; 0: those of this machine
  /// One device for all of this process that open one with the same options; it compiles late and is never closed. For
  /// tests, which open hundreds.
  bool shared = false;
};

struct DeviceLimits {
  std::size_t max_storage_range_bytes = 0;
  std::size_t storage_alignment_bytes = 1;
  std::size_t max_texel_elements = 0;
  std::uint32_t max_groups = 0;  ///< per dispatch
  std::size_t max_allocation_bytes = 0;
  std::uint32_t processors =
      0;  ///< of a software device, each of which runs a group; 0: of others nobody knows
  std::uint32_t lanes_together = 0;  ///< of a subgroup; 0: DeviceOptions say that they do not work together
};

class Device {
 public:
  /// Errors: no_device (a sentence saying what was looked for, what was found, what to install).
  /// Every thread of the driver is created in here, with the caller's scheduling policy and affinity; those
  /// of the caller stay as they are (see README.md of this room).
  static Result<std::unique_ptr<Device>> open(const DeviceOptions& options);
  /// What open could choose from, in the order of the indices; devices that do not fit too. Empty: none.
  static std::vector<DeviceInfo> list();
  ~Device();

  const DeviceInfo& info() const noexcept;
  const DeviceLimits& limits() const noexcept;
  bool lost() const noexcept;
  /// The errors and warnings of the validation layer so far, each text once; empty without validation.
  /// Thread-safe.
  std::vector<std::string> validation_messages() const;

  /// Errors: capacity (names the limit), out_of_memory, device_lost. Misuse: no bytes; texels and a size that
  /// is not a multiple of 16. The bytes are not cleared.
  Result<Buffer> create_buffer(const BufferOptions& options);
  /// One after the other; those before the one that fails are there.
  Result<void> create_buffers(std::span<const BufferWanted> wanted);
  /// Late: a pipeline is compiled by its first dispatch, whose recorder can only say that the device is lost when that
  /// fails. For a device that has to answer soon and will not need them all. Off at first.
  void compile_late(bool late) noexcept;
  /// What the driver keeps of the pipelines made so far, for another device to begin with; of a lost device too. Empty
  /// where it can not be had.
  std::vector<std::byte> compiled() const;
  bool compiles_late() const noexcept;
  /// Checks the shader's reflected bindings, push constants and group size against the table; a difference is
  /// an internal fault and asserts. Errors: capacity (the group size), out_of_memory, device_lost.
  Result<Pipeline> create_pipeline(ShaderId shader);
  Result<Pipeline> create_pipeline(const ShaderInfo& shader);  ///< a shader of another table: tests
  /// `buffers` in the order of the shader's bindings. A buffer without the view that the table asks for, or a
  /// part that does not lie in its buffer, is misuse. Errors: capacity (more than max_storage_range_bytes of a
  /// storage buffer), out_of_memory, device_lost.
  Result<Bindings> create_bindings(const Pipeline& pipeline, std::span<const Buffer* const> buffers);
  Result<Bindings> create_bindings(const Pipeline& pipeline, std::span<const BufferPart> parts);
  Result<Recorder> create_recorder();
  Result<Timeline> create_timeline();

  struct Impl;

 private:
  explicit Device(std::shared_ptr<Impl> impl);
  static Result<std::shared_ptr<Impl>> open_impl(const DeviceOptions& options);
  Result<Pipeline> create_pipeline(const ShaderInfo& shader, std::shared_ptr<Kernel>& kernel);
  std::shared_ptr<Impl> impl_;  // what the device made keeps it alive
};

}  // namespace rtstdb::gpu
