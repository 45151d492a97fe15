"""A made-up creep test after the NFDI-MatWerk data schema: its document and its series."""

from __future__ import annotations

from typing import Any

SERIES_NAME = "Q7-Creep.LIS"
LIS_HEAD = (
    "ENTRY\tSYMBOL\tUNIT\t\t* Information common to all tests\t\t\n"
    "Date of test start\t\t\t1.2.24 9:06 AM\t\t\t\n"
    "Test ID\t\t\tQ7\t\t\t\n"
    "Specified temperature\tT\t°C\t950\t*\t\t\n"
    "Type of loading\t\t\tTension\t*\t\t\n"
    "Initial stress\tRo\tMPa\t152.5\t\t\t\n"
    "(Digital) Material Identifier\t\t\tALLOY-X\t*\t\t\n"
    "Test duration\tt\th\t61,5\t\t\t\n"
    "Creep rupture time\ttu\th\t61,5\t\t\t\n"
    "Percentage initial total extension\teti\t%\t0,251\t\t\t\n"
)
ROWS = (
    "0.0\t0.0\t950.5\t951.5\n0.25\t0.0125\t950.25\t951.0\n10.5\t0.2125\t950.0\t951.25\n60.75\t2.5125\t949.75\t951.25\n"
)
LIS = (
    "LAB 1 Q7.LIS\t\t\t\t\t\t\n-----\t\t\t\t\t\t\n" + LIS_HEAD + "\t\t\t\t\t\t\n[data]\t\t\t\t\t\t\n"
    "Elapsed time from end of loading\tPercentage creep extension\tCorrected measured temperature - Top"
    "\tCorrected measured temperature - Bottom\t\t\nt\tef\tTc\tTc\t\t\nh\t%\t°C\t°C\t\t\n" + ROWS
)


def value(number: str, unit: str = "") -> dict[str, str]:
    """A number as the schema writes it."""
    return {"value": number, "unit": unit}


def document(**changes: Any) -> dict[str, Any]:
    """The document of the test; changes : testParameters that differ, `link` (to the series), `rupture`, `duration`."""
    link = changes.pop("link", f'Data series in the file "{SERIES_NAME}"')
    rupture, duration = (changes.pop(name, value("61.5", "h")) for name in ("rupture", "duration"))
    parameters = {
        "specifiedTemperature": value("950", "°C"),
        "typeOfLoading": "Tension",
        "loadControlType": "Constant Force",
        "initialStress": value("152.5", "MPa"),
        "endOfTestCriterium": {"endOfTestCriteriumOptions": "Test piece break"},
    }
    during = {"elapsedTimeFromEndOfLoading": value(link, "s / h"), "testDuration": duration}
    return {
        "MeasurementData": {
            "AdditionalMetadata": {
                "TestInfo": {"testJobDetails": {"testID": "Q7"}, "testParameters": parameters | changes},
                "MaterialHistoryAndCondition": {"materialIdentifier": "ALLOY-X"},
            },
            "PrimaryData": {
                "TestResult": {
                    "valuesRecordedDuringTestRun": during,
                    "valuesRecordedAfterTestEnd": {"creepRuptureTime": rupture},
                }
            },
            "SecondaryData": {
                "TestResult": {"extensionValues": {"percentageInitialTotalExtension": value("0.251", "%")}}
            },
        }
    }
