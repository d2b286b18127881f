"""A controller's FMU in a loop with a plant in Python, through FMPy: `python loop.py spba.fmu`."""

import sys

import fmpy

GAIN, TIME, STEP = 0.003, 0.5, 0.01  # of a first-order plant: 1/mm a volt, s, s
REFERENCE, PRESSURE, SAMPLES = 0.01, 0.1, 500


def main(path: str) -> None:
    folder = fmpy.extract(path)
    description = fmpy.read_model_description(folder)
    number = {variable.name: variable.valueReference for variable in description.modelVariables}
    unit = fmpy.instantiate_fmu(folder, description)
    unit.enterInitializationMode()
    unit.exitInitializationMode()
    curvature = 0.0
    inputs = [number["ref"], number["meas"], number["sched"]]
    for k in range(SAMPLES):
        unit.setFloat64(inputs, [REFERENCE, curvature, PRESSURE])
        unit.doStep(currentCommunicationPoint=k * STEP, communicationStepSize=STEP)
        volts = unit.getFloat64([number["u"]])[0]
        curvature += STEP / TIME * (GAIN * volts - curvature)
        if (k + 1) % 100 == 0:
            print(f"{(k + 1) * STEP:.0f} s  {volts:.3f} V  {curvature:.5f} 1/mm")
    unit.terminate()
    unit.freeInstance()


if __name__ == "__main__":
    main(sys.argv[1])
