//! Small motion files in every format.

/// A T-posed body of 1.7 m in centimetres whose left hip is at +x and head at +y, as most BVH files have it.
const BVH: &str = "\
HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Spine
  {
    OFFSET 0 20 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT Head
    {
      OFFSET 0 45 0
      CHANNELS 3 Zrotation Xrotation Yrotation
      End Site
      {
        OFFSET 0 10 0
      }
    }
    JOINT LeftArm
    {
      OFFSET 18 30 0
      CHANNELS 3 Zrotation Xrotation Yrotation
      JOINT LeftForeArm
      {
        OFFSET 28 0 0
        CHANNELS 3 Zrotation Xrotation Yrotation
        JOINT LeftHand
        {
          OFFSET 25 0 0
          CHANNELS 3 Zrotation Xrotation Yrotation
          End Site
          {
            OFFSET 15 0 0
          }
        }
      }
    }
    JOINT RightArm
    {
      OFFSET -18 30 0
      CHANNELS 3 Zrotation Xrotation Yrotation
      JOINT RightForeArm
      {
        OFFSET -28 0 0
        CHANNELS 3 Zrotation Xrotation Yrotation
        JOINT RightHand
        {
          OFFSET -25 0 0
          CHANNELS 3 Zrotation Xrotation Yrotation
          End Site
          {
            OFFSET -15 0 0
          }
        }
      }
    }
  }
  JOINT LeftUpLeg
  {
    OFFSET 9 -5 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT LeftLeg
    {
      OFFSET 0 -42 0
      CHANNELS 3 Zrotation Xrotation Yrotation
      JOINT LeftFoot
      {
        OFFSET 0 -40 0
        CHANNELS 3 Zrotation Xrotation Yrotation
        End Site
        {
          OFFSET 0 -6 13
        }
      }
    }
  }
  JOINT RightUpLeg
  {
    OFFSET -9 -5 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT RightLeg
    {
      OFFSET 0 -42 0
      CHANNELS 3 Zrotation Xrotation Yrotation
      JOINT RightFoot
      {
        OFFSET 0 -40 0
        CHANNELS 3 Zrotation Xrotation Yrotation
        End Site
        {
          OFFSET 0 -6 13
        }
      }
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.01
";

/// The fixture with two frames: 1 m up with the head turned by `head` degrees, then 50 cm further and turned left by
/// 90 degrees with the left forearm bent by 90.
pub(super) fn bvh_text(head: &str) -> String {
    let zeros = vec!["0"; 3 * 14];
    let (mut first, mut second) = (zeros.clone(), zeros);
    // Node order: Hips, Spine, Head, LeftArm, LeftForeArm ..; three rotations each after those of the hips.
    first[3] = head;
    second[3 * 4 - 1] = "-90";
    let first = format!("0 100 0 0 0 0 {}", first.join(" "));
    let second = format!("0 100 50 0 0 90 {}", second.join(" "));
    format!("{BVH}{first}\n{second}\n")
}

/// A skeleton with CMU's bones, thighs 20 degrees outwards.
pub(super) fn asf_text() -> String {
    let bones = [
        ("lhipjoint", "1 -1 0", 1.5, ""),
        ("lfemur", "0.34202 -0.939693 0", 7.4, "dof rx ry rz"),
        ("ltibia", "0.34202 -0.939693 0", 7.2, "dof rx"),
        ("lfoot", "0 -0.2 1", 2.3, "dof rx rz"),
        ("ltoes", "0 0 1", 1.1, "dof rx"),
        ("lowerback", "0 1 0", 2.0, "dof rx ry rz"),
        ("upperback", "0 1 0", 2.0, "dof rx ry rz"),
        ("thorax", "0 1 0", 2.0, "dof rx ry rz"),
        ("lowerneck", "0 1 0", 1.6, "dof rx ry rz"),
        ("upperneck", "0 1 0", 1.6, "dof rx ry rz"),
        ("head", "0 1 0", 1.6, "dof rx ry rz"),
        ("lclavicle", "1 0.2 0", 3.4, "dof ry rz"),
        ("lhumerus", "1 0 0", 5.0, "dof rx ry rz"),
        ("lradius", "1 0 0", 3.5, "dof rx"),
        ("lwrist", "1 0 0", 1.8, "dof ry"),
        ("lhand", "1 0 0", 0.8, "dof rx rz"),
        ("lfingers", "1 0 0", 0.6, "dof rx"),
        ("lthumb", "0.7 0 0.7", 0.7, "dof rx rz"),
    ];
    let mut text = ":version 1.10\n:name test\n:units\n  mass 1.0\n  length 0.45\n  angle deg\n\
        :root\n  order TX TY TZ RX RY RZ\n  axis XYZ\n  position 0 0 0\n  orientation 0 0 0\n:bonedata\n"
        .to_owned();
    let middle = [
        "lowerback",
        "upperback",
        "thorax",
        "lowerneck",
        "upperneck",
        "head",
    ];
    for side in ["l", "r"] {
        for (name, direction, length, dof) in bones {
            if middle.contains(&name) && side == "r" {
                continue;
            }
            let (name, direction) = if side == "r" {
                (
                    format!("r{}", &name[1..]),
                    format!("-{direction}").replace("--", ""),
                )
            } else {
                (name.to_owned(), direction.to_owned())
            };
            let axis = match &name[1..] {
                "femur" if side == "l" => "0 0 20",
                "femur" => "0 0 -20",
                _ => "0 0 0",
            };
            text += &format!(
                "begin\n  name {name}\n  direction {direction}\n  length {length}\n  axis {axis} XYZ\n  {dof}\nend\n"
            );
        }
    }
    text += ":hierarchy\nbegin\nroot lhipjoint rhipjoint lowerback\nlowerback upperback\nupperback thorax\n\
        thorax lowerneck lclavicle rclavicle\nlowerneck upperneck\nupperneck head\n";
    for side in ["l", "r"] {
        for chain in [
            &["hipjoint", "femur", "tibia", "foot", "toes"][..],
            &["clavicle", "humerus", "radius", "wrist", "hand", "fingers"],
            &["wrist", "thumb"],
        ] {
            for pair in chain.windows(2) {
                text += &format!("{side}{} {side}{}\n", pair[0], pair[1]);
            }
        }
    }
    text + "end\n"
}

/// Two frames: legs straight down; then the left leg lifted forwards by 90 degrees.
pub(super) fn amc_text() -> String {
    let mut text = "#!OML:ASF\n:FULLY-SPECIFIED\n:DEGREES\n".to_owned();
    for (number, lift) in [(1, "0"), (2, "-90")] {
        text += &format!("{number}\nroot 1 17 2 0 0 0\nlfemur {lift} 0 -20\nrfemur 0 0 20\n");
        for name in [
            "lowerback",
            "upperback",
            "thorax",
            "lowerneck",
            "upperneck",
            "head",
        ] {
            text += &format!("{name} 0 0 0\n");
        }
        for side in ["l", "r"] {
            for (name, count) in [
                ("tibia", 1),
                ("foot", 2),
                ("toes", 1),
                ("clavicle", 2),
                ("humerus", 3),
                ("radius", 1),
                ("wrist", 1),
                ("hand", 2),
                ("fingers", 1),
                ("thumb", 2),
            ] {
                text += &format!("{side}{name}{}\n", " 0".repeat(count));
            }
        }
    }
    text
}

/// Rest pose and one frame in which legs hang straight and the root has turned left by 90 degrees.
pub(super) fn expmap_text() -> String {
    let mut values = vec![0.0; 117];
    values[..3].copy_from_slice(&[0.0, 17.0, 0.0]);
    let down = 20f64.to_radians();
    values[3 + 3 * 2 + 2] = down;
    values[3 + 3 * 8 + 2] = -down;
    let line = |values: &[f64]| {
        values
            .iter()
            .map(f64::to_string)
            .collect::<Vec<_>>()
            .join(",")
            + "\n"
    };
    let rest = line(&values);
    values[4] = -std::f64::consts::FRAC_PI_2;
    rest + &line(&values)
}
