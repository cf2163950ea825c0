#pragma once

namespace raylign {

/// Where files are decoded whose formats are read by libraries of others (volumes, images, transforms).
enum class Decoding {
    own_process,  ///< in a process of its own for each file: one that crashes, hangs or takes all memory is an Error
    in_process,   ///< by the caller's thread: for debuggers
};

/// The default is own_process. For the whole program; call it before the first file is read.
void set_decoding(Decoding how);

/// Starts the small server process that forks those processes. Without this call the first reading starts it, which is
/// as good as long as the program then has no threads that hold locks: call it at the beginning of main(), before
/// threads, MPI_Init and graphics. It ends with the program, keeps no file of it open and ignores the terminal's
/// signals. Where it cannot be started, files are decoded in process.
void start_decoding_server();

}  // namespace raylign
