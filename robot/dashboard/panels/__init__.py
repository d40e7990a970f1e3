"""What is shown and tuned beside the view: charts, figures, controls, health."""
