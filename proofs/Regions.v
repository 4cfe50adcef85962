(** Trees for regions and for limits.

    A region is a union of parts, each a list of conditions by their numbers.  A condition
    has two polynomials in time: [kept] is not negative where it holds, [broken] is positive
    where it fails.  At a margin the two differ, and both speak of a whole ball.  Choices are
    lists of conditions: who keeps one of each is in some part. *)

Require Import Reals Lra Lia ZArith List Bool.
From LtlPlan Require Import Bernstein Crossing Halves Tree.
Import ListNotations.

(** ** The algorithm *)

Record condition := Condition { kept : list Z; broken : list Z }.
Record region := Region { parts : list (list nat); choices : list (list nat) }.

(** Near is nowhere out; who comes in is out and then nowhere out, who goes out the other way round. *)
Inductive mark := Must | No | Near | Coming | Out | Open.
Inductive status := Kept | Broken | Unclear.

Definition both (f : list Z -> list Z) (q : condition) : condition :=
  Condition (f (kept q)) (f (broken q)).

Definition known_of (q : condition) : status :=
  if all_positive (broken q) then Broken else if all_nonneg (kept q) then Kept else Unclear.

Definition is_kept (s : status) : bool := match s with Kept => true | _ => false end.
Definition is_broken (s : status) : bool := match s with Broken => true | _ => false end.

Definition all_kept (r : region) (st : nat -> status) : bool :=
  forallb (existsb (fun k => is_kept (st k))) (choices r).
Definition all_broken (r : region) (st : nat -> status) : bool :=
  forallb (existsb (fun k => is_broken (st k))) (parts r).

Definition statuses (c : list condition) (k : nat) : status :=
  match nth_error c k with Some q => known_of q | None => Unclear end.

(** What some test says of the function that is positive where a condition is broken. *)
Definition tested (test : list Z -> bool) (c : list condition) (k : nat) : bool :=
  match nth_error c k with Some q => test (broken q) | None => false end.

Definition near (r : region) (c : list condition) : bool :=
  forallb (existsb (tested none_positive c)) (choices r).

(** Of each part some condition is broken, or none is whose function does not rise, or fall. *)
Definition one_way (way : list Z -> bool) (r : region) (c : list condition) : bool :=
  forallb (fun p => existsb (fun k => is_broken (statuses c k)) p
    || forallb (fun k => tested none_positive c k || tested way c k) p) (parts r).
Definition falling (l : list Z) : bool := rising (rev l).

Definition holds (r : region) (m : mark) (c : list condition) : bool :=
  match m with
  | Must => all_kept r (statuses c)
  | No => all_broken r (statuses c)
  | Near => near r c
  | Coming => one_way falling r c
  | Out => one_way rising r c
  | Open => true
  end.

Definition check_region (r : region) (c : list condition) (steps : list (step mark)) :
    option (list (leaf mark)) :=
  check_tree _ _ (map (both first_half)) (map (both second_half)) (holds r) c steps.

(** ** What the marks say *)

Open Scope R_scope.

Definition times : Type := R -> R.

(** ** A stay: it comes once and goes once *)

Definition comes (P : R -> Prop) (a b : R) : Prop := forall x y, a <= x -> x <= y -> y <= b -> P x -> P y.
Definition goes (P : R -> Prop) (a b : R) : Prop := forall x y, a <= x -> x <= y -> y <= b -> P y -> P x.

Lemma comes_joined : forall P a b c, comes P a b -> comes P b c -> comes P a c.
Proof.
  intros P a b c H G x y Hx Hxy Hy Px; destruct (Rle_lt_dec y b) as [L|L]; [apply (H x y); auto|].
  destruct (Rle_lt_dec b x) as [M|M]; [apply (G x y); auto|].
  apply (G b y); try lra; apply (H x b); auto; lra.
Qed.

Lemma goes_joined : forall P a b c, goes P a b -> goes P b c -> goes P a c.
Proof.
  intros P a b c H G x y Hx Hxy Hy Py; destruct (Rle_lt_dec y b) as [L|L]; [apply (H x y); auto|].
  destruct (Rle_lt_dec b x) as [M|M]; [apply (G x y); auto|].
  apply (H x b); try lra; apply (G b y); auto; lra.
Qed.

Theorem one_stay : forall P a b c x y z, comes P a b -> goes P b c ->
  a <= x -> x <= y -> y <= z -> z <= c -> P x -> P z -> P y.
Proof.
  intros P a b c x y z H G Hx Hxy Hyz Hz Px Pz; destruct (Rle_lt_dec y b) as [L|L];
    [apply (H x y) | apply (G y z)]; auto; lra.
Qed.

Section Marks.
  Variable r : region.
  (** The two functions of time of each condition, by its number. *)
  Variable f : nat -> times * times.

  Definition known (a b : R) (c : list condition) : Prop :=
    forall k q, nth_error c k = Some q ->
      represents (kept q) (fst (f k)) a b /\ represents (broken q) (snd (f k)) a b.

  (** By the polynomials, at time [x] it is not out of the region. *)
  Definition maybe (x : R) : Prop :=
    exists p, In p (parts r) /\ forall k, In k p -> snd (f k) x <= 0.

  Definition says (m : mark) (a b : R) : Prop :=
    match m with
    | Open => True
    | Must => always (fun x => forall p, In p (choices r) -> exists k, In k p /\ 0 <= fst (f k) x) a b
    | No => always (fun x => forall p, In p (parts r) -> exists k, In k p /\ 0 < snd (f k) x) a b
    | Near => always (fun x => forall p, In p (choices r) -> exists k, In k p /\ snd (f k) x <= 0) a b
    | Coming => comes maybe a b
    | Out => goes maybe a b
    end.

  Lemma known_cut : forall (h : list Z -> list Z) a b a' b' c,
    (forall l g, represents l g a b -> represents (h l) g a' b') ->
    known a b c -> known a' b' (map (both h) c).
  Proof.
    intros h a b a' b' c H K k q N; rewrite nth_error_map in N.
    destruct (nth_error c k) as [q0|] eqn:E; [|discriminate]; injection N as <-.
    destruct (K k q0 E); split; cbn; auto.
  Qed.

  Lemma known_sound : forall a b c k x, a < b -> known a b c -> a <= x <= b ->
    (statuses c k = Kept -> 0 <= fst (f k) x) /\ (statuses c k = Broken -> 0 < snd (f k) x).
  Proof.
    intros a b c k x Hab K Hx; unfold statuses, known_of.
    destruct (nth_error c k) as [q|] eqn:E; [|split; discriminate].
    destruct (K k q E) as [K1 K2]; split; destruct (all_positive (broken q)) eqn:P;
      try discriminate; destruct (all_nonneg (kept q)) eqn:N; try discriminate; intros _.
    - apply (all_nonneg_sound (kept q) (fst (f k)) a b); auto.
    - apply (all_positive_sound (broken q) (snd (f k)) a b); auto.
    - apply (all_positive_sound (broken q) (snd (f k)) a b); auto.
  Qed.

  Lemma some_sound : forall (is : status -> bool) st (P : nat -> Prop) lists,
    (forall k, is (st k) = true -> P k) -> forallb (existsb (fun k => is (st k))) lists = true ->
    forall p, In p lists -> exists k, In k p /\ P k.
  Proof.
    intros is st P lists S H p Hp; rewrite forallb_forall in H.
    apply H, existsb_exists in Hp as (k & Hk & B); exists k; auto.
  Qed.

  Lemma tested_sound : forall a b c k x, a < b -> known a b c -> a <= x <= b ->
    tested none_positive c k = true -> snd (f k) x <= 0.
  Proof.
    intros a b c k x Hab K Hx H; unfold tested in H.
    destruct (nth_error c k) as [q|] eqn:N; [|discriminate]; destruct (K k q N) as [_ Kq].
    apply (none_positive_sound (broken q) (snd (f k)) a b); auto.
  Qed.

  (** At time [x] it is not out where it is not at time [y], if each function is then no greater. *)
  Lemma one_way_sound : forall way a b c x y, a < b -> known a b c -> one_way way r c = true ->
    a <= x <= b -> a <= y <= b ->
    (forall l g, represents l g a b -> way l = true -> g x <= g y) -> maybe y -> maybe x.
  Proof.
    intros way a b c x y Hab K H Hx Hy W (p & Hp & I); exists p; split; auto; intros k Hk.
    unfold one_way in H; rewrite forallb_forall in H; specialize (H p Hp).
    apply orb_prop in H as [H|H].
    - apply existsb_exists in H as (j & Hj & B); specialize (I j Hj).
      destruct (known_sound a b c j y Hab K Hy) as [_ S].
      assert (0 < snd (f j) y); [|lra].
      apply S; destruct (statuses c j); auto; discriminate.
    - rewrite forallb_forall in H; specialize (H k Hk); specialize (I k Hk).
      apply orb_prop in H as [H|H]; [apply (tested_sound a b c k x Hab K Hx H)|].
      unfold tested in H; destruct (nth_error c k) as [q|] eqn:N; [|discriminate].
      destruct (K k q N) as [_ Kq]; specialize (W _ _ Kq H); lra.
  Qed.

  (** Who is out, and then not, does not go out again. *)
  Theorem comes_near_once : forall a b c, a < b -> known a b c -> one_way falling r c = true -> comes maybe a b.
  Proof.
    intros a b c Hab K H x y Hx Hxy Hy; apply (one_way_sound falling a b c y x); auto; try lra.
    intros l g L F; apply (falls_sound l g a b x y); auto.
  Qed.

  (** Who is not out, and then out, does not come back. *)
  Theorem leaves_once : forall a b c, a < b -> known a b c -> one_way rising r c = true -> goes maybe a b.
  Proof.
    intros a b c Hab K H x y Hx Hxy Hy; apply (one_way_sound rising a b c x y); auto; try lra.
    intros l g L F; apply (rises_sound l g a b x y); auto.
  Qed.

  Lemma holds_sound : forall m a b c, a < b -> known a b c -> holds r m c = true -> says m a b.
  Proof.
    intros [| | | | |] a b c Hab K H; cbn in H |- *; auto.
    - intros x Hx; apply (some_sound is_kept (statuses c)); auto; intros k B.
      apply (known_sound a b c k x Hab K Hx); destruct (statuses c k); auto; discriminate.
    - intros x Hx; apply (some_sound is_broken (statuses c)); auto; intros k B.
      apply (known_sound a b c k x Hab K Hx); destruct (statuses c k); auto; discriminate.
    - intros x Hx p Hp; unfold near in H; rewrite forallb_forall in H.
      apply H, existsb_exists in Hp as (k & Hk & B); exists k; split; auto.
      apply (tested_sound a b c k x Hab K Hx B).
    - apply (comes_near_once a b c); auto.
    - apply (leaves_once a b c); auto.
  Qed.

  (** The leaves of a checked tree cover the interval, and their marks are true. *)
  Theorem check_region_sound : forall c steps leaves, known 0 1 c ->
    check_region r c steps = Some leaves -> tiles mark says 0 1 leaves.
  Proof.
    intros c steps leaves K H.
    apply (check_tree_sound _ _ (map (both first_half)) (map (both second_half)) (holds r) known says)
      with c steps; auto.
    - intros a b d; apply known_cut; intros; apply first_represents; auto.
    - intros a b d; apply known_cut; intros; apply second_represents; auto.
    - apply holds_sound.
  Qed.

  (** *** From polynomials to every point of the tube *)

  Variables (Point : Type) (tube : R -> Point -> Prop).
  (** Conditions as sets of points; what their polynomials say of the tube. *)
  Variable meets : nat -> Point -> Prop.
  Hypothesis about : forall k t q, tube t q ->
    (0 <= fst (f k) t -> meets k q) /\ (0 < snd (f k) t -> ~ meets k q).

  Definition in_region (q : Point) : Prop :=
    exists p, In p (parts r) /\ forall k, In k p -> meets k q.

  Theorem no_tube : forall a b, says No a b ->
    forall t q, a <= t <= b -> tube t q -> ~ in_region q.
  Proof.
    intros a b S t q Ht Tq (p & Hp & I); destruct (S t Ht p Hp) as (k & Hk & P).
    destruct (about k t q Tq) as [_ N]; apply (N P), I; auto.
  Qed.

  Theorem must_tube : forall a b,
    (forall q, (forall p, In p (choices r) -> exists k, In k p /\ meets k q) -> in_region q) ->
    says Must a b -> forall t q, a <= t <= b -> tube t q -> in_region q.
  Proof.
    intros a b C S t q Ht Tq; apply C; intros p Hp; destruct (S t Ht p Hp) as (k & Hk & P).
    exists k; split; auto; apply (about k t q Tq); auto.
  Qed.
End Marks.

(** Who keeps one condition of each way to choose one of every part is in some part. *)
Theorem some_part : forall (C : Type) (keeps : C -> Prop) (parts : list (list C)),
  (forall k, keeps k \/ ~ keeps k) ->
  (forall choice, Forall2 (fun k p => In k p) choice parts -> exists k, In k choice /\ keeps k) ->
  exists p, In p parts /\ forall k, In k p -> keeps k.
Proof.
  intros C keeps parts Dec; induction parts as [|p parts IH]; intros H.
  - destruct (H [] (Forall2_nil _)) as (k & [] & _).
  - assert (W : (forall k, In k p -> keeps k) \/ exists k, In k p /\ ~ keeps k).
    { clear H IH; induction p as [|k p [A|(j & Hj & N)]]; [left; intros k [] | |].
      - destruct (Dec k); [left; intros j [<-|]; auto | right; exists k; split; [left|]; auto].
      - right; exists j; split; [right|]; auto. }
    destruct W as [A|(k & Hk & N)]; [exists p; split; [left|]; auto|].
    destruct IH as (p' & Hp & A); [|exists p'; split; [right|]; auto].
    intros choice F; destruct (H (k :: choice)) as (j & [<-|Hj] & P); [constructor; auto | contradiction|].
    exists j; auto.
Qed.

(** Where a sum of two functions, with weights above zero, is not above zero, one of them is not. *)
Theorem faces_meet : forall f g w, 0 < w -> f + w * g <= 0 -> f <= 0 \/ g <= 0.
Proof. intros f g w Hw H; destruct (Rle_lt_dec f 0); [left; auto | right; nra]. Qed.

(** ** Limits: one polynomial that is nowhere negative *)

Definition check_nonneg (l : list Z) (steps : list (step unit)) : bool :=
  match check_tree _ _ first_half second_half (fun _ => all_nonneg) l steps with
  | Some (_ :: _) => true
  | _ => false
  end.

Theorem check_nonneg_sound : forall l f steps, represents l f 0 1 ->
  check_nonneg l steps = true -> always (fun x => 0 <= f x) 0 1.
Proof.
  intros l f steps K H x Hx; unfold check_nonneg in H.
  destruct (check_tree _ _ _ _ _ _ _) as [[|p leaves]|] eqn:E; try discriminate.
  pose proof (check_tree_sound _ _ first_half second_half (fun _ : unit => all_nonneg)
    (fun a b c => represents c f a b) (fun _ a b => always (fun x => 0 <= f x) a b)) as T.
  specialize (T (fun a b c => first_represents c f a b) (fun a b c => second_represents c f a b)
    (fun _ a b c L R => all_nonneg_sound c f a b L R) _ _ _ K E).
  destruct (tiles_cover _ _ _ _ _ x T Hx) as (m & k & d & _ & B & S); [discriminate|].
  apply S; auto.
Qed.
