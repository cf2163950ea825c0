# A formula for Homebrew on Linux. UNTRIED: Homebrew is not there where this was written; on macOS raylign has never been built.
# The backends gl, which open the machine's own driver, are left out. For a release: a stable url with its sha256.
class Raylign < Formula
  desc "2-D/3-D rigid registration of CT volumes to X-ray images"
  license "Apache-2.0"
  head "file://#{File.expand_path("../..", __dir__)}", using: :git, branch: "main"

  depends_on "assimp"
  depends_on "cli11" => :build
  depends_on "cmake" => :build
  depends_on "ninja" => :build
  depends_on "nlohmann-json" => :build
  depends_on "xsimd" => :build
  depends_on "eigen"
  depends_on "hdf5"
  depends_on "itk"
  depends_on "jpeg-turbo"
  depends_on "libpng"
  depends_on "libtiff"
  depends_on :linux
  depends_on "meshoptimizer"
  depends_on "nlopt"
  depends_on "openssl@3"
  depends_on "tbb"
  depends_on "yaml-cpp"

  uses_from_macos "expat"
  uses_from_macos "zlib"

  def install
    system "cmake", "-S", ".", "-B", "build", "-G", "Ninja", *std_cmake_args,
                    "-DRAYLIGN_UNITY=ON", "-DRAYLIGN_BUILD_TESTS=OFF", "-DRAYLIGN_BUILD_BENCH=OFF",
                    "-DRAYLIGN_BUILD_GL=OFF", "-DRAYLIGN_BUILD_MPI=OFF", "-DRAYLIGN_REPORT_CHARTS=OFF"
    system "cmake", "--build", "build"
    system "cmake", "--install", "build"
  end

  test do
    assert_match "raylign ", shell_output("#{bin}/raylign --version")
    system bin/"raylign", "phantom", "spine", "--size", "32", "-o", "spine.mha"
    assert_path_exists testpath/"spine.mha"
  end
end
