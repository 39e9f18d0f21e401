"""What is prescribed on a body: selections, values on the device, conditions of each kind of formulation, their work."""
