"""What every sensor measures and how it is configured, one module per sensor.

`registry.SENSORS` lists them. The registration is the only place that names every sensor: configuration,
simulation, topics, bags and replay follow from it. A sensor called ``name`` has three modules:

- ``relform_core.sensors.name``: configuration, measurement, and the `Sensor` that ties them;
- ``relform_sensors.name``: the model, made by its function ``mount``;
- ``relform_ros.sensors.name``: the message and its conversions, see ``relform_ros.sensors.wire``.
"""
