/// Read by LeakSanitizer where the build has it: ITK's NRRD and NIfTI libraries leak a few hundred bytes when a file is
/// bad.
// NOLINTNEXTLINE(bugprone-reserved-identifier): the name is the sanitizer's
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() {
    return "leak:libITKNrrdIO\nleak:libITKniftiio\nleak:itk_nrrdNew\n";
}
