# AddressSanitizer (with LeakSanitizer) and UBSan under the same tests: the floors are compiled once more with them, and the tests' objects are linked to these.
# Ten files are compiled as one, which takes half the time.
set(unrig_sanitizers -fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer -O1 -g1 -UNDEBUG
  # Eigen takes its memory as in the tests' objects and in Debian's Ceres; else it would pad what AddressSanitizer watches.
  -DEIGEN_MALLOC_ALREADY_ALIGNED=1)
# null and alignment cost more to compile than all other checks together: only the readers of files and the kernels that work on bare pointers have them.
set(careless_of_pointers -fno-sanitize=null,alignment)
set(careful_of_pointers -fsanitize=null,alignment)
# How they are started (a list of variables in a test's ENVIRONMENT does not survive gtest_discover_tests).
set(in_this_environment env LSAN_OPTIONS=suppressions=${CMAKE_CURRENT_SOURCE_DIR}/known_leaks.txt:print_suppressions=0 UBSAN_OPTIONS=print_stacktrace=1
  UNRIG_TESTED_BINARY=${CMAKE_CURRENT_BINARY_DIR}/sanitised_unrig)

set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS fuzz/sources.txt)
file(STRINGS fuzz/sources.txt careful)
list(APPEND careful core/run_text.cpp core/import/import.cpp)
list(TRANSFORM careful PREPEND ${PROJECT_SOURCE_DIR}/)
set_source_files_properties(${careful} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON COMPILE_OPTIONS "${careful_of_pointers}")
# As in the floors' own lists: source properties hold in one directory.
set(kernels ${PROJECT_SOURCE_DIR}/core/small_product ${PROJECT_SOURCE_DIR}/core/householder)
list(TRANSFORM kernels APPEND .cpp OUTPUT_VARIABLE chosen)
list(TRANSFORM kernels APPEND _avx2.cpp OUTPUT_VARIABLE wide)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  set_source_files_properties(${wide} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON COMPILE_OPTIONS "${careful_of_pointers};${unrig_wide_vectors}")
  set_source_files_properties(${chosen} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON COMPILE_OPTIONS "${careful_of_pointers}" COMPILE_DEFINITIONS UNRIG_WIDE_VECTORS)
else()
  set_source_files_properties(${wide} PROPERTIES HEADER_FILE_ONLY ON)
endif()
# Has a helper that is named like another's.
set_source_files_properties(${PROJECT_SOURCE_DIR}/fit/diagnose/trial.cpp PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)

add_library(unrig_sanitizers INTERFACE)
target_compile_options(unrig_sanitizers INTERFACE ${unrig_sanitizers} ${careless_of_pointers})
target_compile_definitions(unrig_sanitizers INTERFACE UNRIG_VERSION="${PROJECT_VERSION}")
target_link_options(unrig_sanitizers INTERFACE -fsanitize=address,undefined)

set(floors core fit correct)
set(folders core fit correct verification commands)
if(UNRIG_SANITIZE STREQUAL "CORE")
  set(floors core)
  set(folders core)
endif()

# sanitised_core is unrig_core again, and so on; each floor stands on its like.
foreach(floor ${floors})
  get_target_property(sources unrig_${floor} SOURCES)
  get_target_property(below unrig_${floor} LINK_LIBRARIES)
  list(TRANSFORM below REPLACE "^unrig_(core|fit|correct)$" "sanitised_\\1")
  list(FILTER below EXCLUDE REGEX "unrig_warnings")  # the floors themselves are compiled with warnings
  add_library(sanitised_${floor} STATIC ${sources})
  add_dependencies(sanitised_${floor} unrig_${floor})  # which makes the page of the report
  set_target_properties(sanitised_${floor} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 10)
  target_include_directories(sanitised_${floor} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(sanitised_${floor} PUBLIC ${below} unrig_sanitizers)
endforeach()
if(correct IN_LIST floors)
  add_executable(sanitised_unrig ${PROJECT_SOURCE_DIR}/correct/main.cpp)
  target_link_libraries(sanitised_unrig PRIVATE sanitised_correct CLI11::CLI11)
endif()

# The same tests, called sanitised.core.* and so on, but for what is left out, by name as --gtest_filter takes it.
set(left_out Lengths.AMillionSamplesFitIntoASixthOfAGigabyte  # memory under AddressSanitizer is another
  Fit.OfARecordWithoutNoiseConverges)  # its last steps are rounding, which is another too
if(NOT UNRIG_SANITIZE STREQUAL "ALL")  # ten seconds and more each, half an hour some
  list(APPEND left_out Diagnose.* DecaysFirst.* DiagnosedRecordings.* Selection.* Effects.GaugeLowpassIsRecovered
    Trial.NothingHiddenAndAWave Trial.WhatIsHiddenOutsideTheCandidatesCannotBeNamed OpenQuestion.AFitOfOneModeBendsItsParametersToIt
    In/DryFriction.IsTakenOutOfTheLoad/* Given/KnownAmplifier.IsUndone/* LawSteps.OfAFitRefineTheLoadAsTheirSquareAndWithinItsBand
    RunInLegs.TakeRestsForWhatTheyAre RunInLegs.ACalibrationErrorScalesTheLoad RunInLegs.AreForLinearRigs RunInLegs.FollowStepsThatTheKnotsCannotFollow Restless.AnErrorOfTheRigMovesTheLoadAsItsColumnSays Restless.LoadIsFoundInTimeThatGoesWithTheRecord
    Restless.ALongSineDoesNotBendTheSlope Restless.GapsWidenTheBandAndNothingElse
    Restless.APlaceThatIsRougherThanTheRestIsNamed Report.ADiagnosisShowsItsRecordingsAndBothModels ReportInABrowser.LoadsDrawsAndZooms)
endif()
list(JOIN left_out ":" left_out)
foreach(folder ${folders})
  get_target_property(libraries test_${folder} LINK_LIBRARIES)
  list(TRANSFORM libraries REPLACE "^unrig_(core|fit|correct)$" "sanitised_\\1")
  get_target_property(objects test_${folder} SOURCES)
  add_executable(sanitised_test_${folder} ${objects})
  target_link_libraries(sanitised_test_${folder} PRIVATE ${libraries} unrig_sanitizers)
  set_target_properties(sanitised_test_${folder} PROPERTIES CROSSCOMPILING_EMULATOR "${in_this_environment}")
  gtest_discover_tests(sanitised_test_${folder} TEST_PREFIX sanitised.${folder}. TEST_FILTER "-${left_out}" DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT 9000)
endforeach()
if(commands IN_LIST folders)
  add_dependencies(sanitised_test_commands sanitised_unrig)
endif()

# The readers of files on the corpora of their fuzzers (fuzz/README.md).
add_library(unrig_replay OBJECT fuzz/replay.cpp)
target_link_libraries(unrig_replay PUBLIC sanitised_core)
foreach(reader run rig tdms uff mat text)
  add_executable(replay_${reader} fuzz/fuzz_${reader}.cpp)
  target_link_libraries(replay_${reader} PRIVATE unrig_replay)
  set_target_properties(replay_${reader} PROPERTIES CROSSCOMPILING_EMULATOR "${in_this_environment}")
  add_test(NAME sanitised.corpus.${reader} COMMAND replay_${reader} ${CMAKE_CURRENT_SOURCE_DIR}/fuzz/corpus/${reader})
endforeach()
